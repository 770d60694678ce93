/* after median */
/* after finger_shape */
/* Inverse of a symmetric positive matrix from its lower half (Gauss and Jordan), after scaling to a unit diagonal. */
static void inverse(const double *lower, double *a) {
    enum { n = PARAMETERS };
    double scale[n];
    for (int i = 0; i < n; i++) scale[i] = 1.0 / sqrt(lower[i * n + i]);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) a[i * n + j] = lower[(i > j ? i : j) * n + (i > j ? j : i)] * scale[i] * scale[j];
    for (int k = 0; k < n; k++) {
        double pivot = larger(a[k * n + k], SMALLEST_PIVOT);
        a[k * n + k] = 1.0;
        for (int j = 0; j < n; j++) a[k * n + j] /= pivot;
        for (int i = 0; i < n; i++) {
            if (i == k) continue;
            double factor = a[i * n + k];
            a[i * n + k] = 0.0;
            for (int j = 0; j < n; j++) a[i * n + j] -= factor * a[k * n + j];
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) a[i * n + j] *= scale[i] * scale[j];
}

/* Fit of a finger's end. Arguments: x, y, u, is_row, blur, start, origin, u_prior; results, parameters, covariance, residual
   and weight. Returns the misfit. */
LOOP(finger_end_fit, "FFFBFFFFffff", "d") {
    enum { m = PARAMETERS };
    static const double LOOKED[][2] = LOOKS;
    const double *x = FLOATS(0), *start = FLOATS(5), *origin = FLOATS(6), *u_prior = FLOATS(7);
    double *p = FLOATS(8), *covariance = FLOATS(9), *distance = FLOATS(10), *robust = FLOATS(11);
    int64_t n = in[0].n;
    double *jacobian = floats(n * m), *residual = floats(n), *magnitude = floats(n), misfit = 1.0;
    double move[m], right[m], normal[m * m];
    uint8_t *counts = (uint8_t *)room(n, 1), *is_outer = (uint8_t *)room(n, 1);
    memcpy(p, start, sizeof move);
    Corner inner = corner(p, origin, 0), outer = corner(p, origin, 1);
    for (int64_t i = 0; i < n; i++) is_outer[i] = x[i] <= 0.5 * (inner.centre_x + outer.centre_x);
    compared(p, origin, x, FLOATS(1), FLOATS(2), FLAGS(3), is_outer, FLOATS(4), n, distance, jacobian, counts);
    for (int look = 0; look < LOOKS_COUNT; look++) {
        /* During the iteration of the weights, the outline is linearised in its parameters. */
        for (int a = 0; a < m; a++) move[a] = 0.0;
        for (int step = 0; step < 2; step++) {
            double patience = LOOKED[look][step];
            if (patience == 0.0) continue;
            int64_t counted = 0;
            for (int64_t i = 0; i < n; i++) {
                residual[i] = distance[i];
                for (int a = 0; a < m; a++) residual[i] += jacobian[i * m + a] * move[a];
                if (counts[i]) magnitude[counted++] = fabs(residual[i]);
            }
            misfit = within(SIGMAS_IN_MEDIAN * middle_in_place(magnitude, counted), 1.0, WORST_MISFIT);
            double cut = BIWEIGHT_REACH * patience * misfit;
            for (int a = 0; a < m * m; a++) normal[a] = 0.0;
            for (int a = 0; a < m; a++) {
                normal[a * m + a] = 1.0 / square(u_prior[a]);
                right[a] = (p[a] - start[a]) * normal[a * m + a];
            }
            for (int64_t i = 0; i < n; i++) {
                robust[i] = 0.0;
                if (!counts[i] || fabs(residual[i]) >= cut) continue;
                robust[i] = square(1.0 - square(residual[i] / cut));
                const double *by = jacobian + i * m;
                for (int a = 0; a < m; a++) {
                    if (by[a] == 0.0) continue; /* most points depend on two parameters only */
                    double weighted = robust[i] * by[a];
                    right[a] += weighted * distance[i];
                    for (int b = 0; b <= a; b++) normal[a * m + b] += weighted * by[b];
                }
            }
            inverse(normal, covariance);
            for (int a = 0; a < m; a++) {
                move[a] = 0.0;
                for (int b = 0; b < m; b++) move[a] -= covariance[a * m + b] * right[b];
            }
        }
        for (int a = 0; a < m; a++) p[a] += move[a];
        p[INNER_R] = larger(p[INNER_R], 0.0);
        p[OUTER_R] = larger(p[OUTER_R], 0.0);
        compared(p, origin, x, FLOATS(1), FLOATS(2), FLAGS(3), is_outer, FLOATS(4), n, distance, jacobian, counts);
    }
    out[0].d = misfit;
    free(jacobian);
    free(residual);
    free(magnitude);
    free(counts);
    free(is_outer);
}
