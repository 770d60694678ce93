/* after linear_solve */
/* Logarithm of the restricted likelihood, but for a constant, of the residuals of a parabola whose points have this
   covariance (n, n), of which the lower half is overwritten: columns (n, OWN + 1), the last one the points themselves.
   0 in `is_sound` where the covariance is not positive. */
static double restricted(double *covariance, double *columns, int64_t n, int *is_sound) {
    enum { WIDE = OWN + 1 };
    double normal[OWN * OWN] = {0.0}, solved[OWN] = {0.0}, lower[OWN * OWN], logarithm = 0.0, left = 0.0;
    for (int64_t i = 0; i < n; i++) {
        double *row = covariance + i * n;
        for (int64_t j = 0; j <= i; j++) {
            double *other = covariance + j * n, total = row[j];
            for (int64_t k = 0; k < j; k++) total -= row[k] * other[k];
            if (j < i) {
                row[j] = total / other[j];
            } else {
                if (!(total > 0.0)) {
                    *is_sound = 0;
                    return 0.0;
                }
                row[i] = sqrt(total);
                logarithm += 2.0 * log(row[i]);
            }
        }
        for (int c = 0; c < WIDE; c++) {
            double total = columns[i * WIDE + c];
            for (int64_t k = 0; k < i; k++) total -= row[k] * columns[k * WIDE + c];
            columns[i * WIDE + c] = total / row[i];
        }
    }
    for (int64_t i = 0; i < n; i++)
        for (int a = 0; a < OWN; a++) {
            solved[a] += columns[i * WIDE + a] * columns[i * WIDE + OWN];
            for (int b = 0; b < OWN; b++) normal[a * OWN + b] += columns[i * WIDE + a] * columns[i * WIDE + b];
        }
    memcpy(lower, normal, sizeof lower);
    for (int a = 0; a < OWN; a++) { /* determinant by elimination */
        if (!(lower[a * OWN + a] > 0.0)) {
            *is_sound = 0;
            return 0.0;
        }
        logarithm += log(lower[a * OWN + a]);
        for (int b = a + 1; b < OWN; b++) {
            double factor = lower[b * OWN + a] / lower[a * OWN + a];
            for (int c = a; c < OWN; c++) lower[b * OWN + c] -= factor * lower[a * OWN + c];
        }
    }
    if (!solve(normal, OWN, solved, 1)) *is_sound = 0;
    for (int64_t i = 0; i < n; i++) {
        double rest = columns[i * WIDE + OWN];
        for (int a = 0; a < OWN; a++) rest -= columns[i * WIDE + a] * solved[a];
        left += rest * rest;
    }
    return -0.5 * (logarithm + left);
}

/* Logarithm of the restricted likelihood of every deviation and length: along, across, variance of the points, deviations,
   lengths; likelihood (deviations, lengths); whether it went, and the likelihood of no roughness. */
LOOP(roughness_likelihood, "FFFFFf", "bd") {
    enum { WIDE = OWN + 1 };
    const double *along = FLOATS(0), *variance = FLOATS(2);
    int64_t n = in[0].n, deviations = in[3].n, lengths = in[4].n;
    double *basis = floats(2 * n * WIDE + 2 * n * n), *columns = basis + n * WIDE, *correlation = columns + n * WIDE;
    double *covariance = correlation + n * n, mean = 0.0, most = 1.0;
    int is_sound = 1;
    for (int64_t i = 0; i < n; i++) mean += along[i];
    mean /= (double)n;
    for (int64_t i = 0; i < n; i++) most = larger(most, fabs(along[i] - mean));
    for (int64_t i = 0; i < n; i++) {
        basis[i * WIDE] = 1.0;
        for (int k = 1; k < OWN; k++) basis[i * WIDE + k] = basis[i * WIDE + k - 1] * ((along[i] - mean) / most);
        basis[i * WIDE + OWN] = FLOATS(1)[i];
    }
    for (int64_t which = -1; which < lengths; which++) {
        for (int64_t i = 0; i < n && which >= 0; i++)
            for (int64_t j = 0; j <= i; j++) {
                double scaled = sqrt(5.0) * fabs(along[j] - along[i]) / FLOATS(4)[which];
                correlation[i * n + j] = (1.0 + scaled + scaled * scaled / 3.0) * exp(-scaled);
            }
        for (int64_t k = 0; k < (which < 0 ? 1 : deviations); k++) {
            for (int64_t i = 0; i < n; i++)
                for (int64_t j = 0; j <= i; j++)
                    covariance[i * n + j] = (i == j ? variance[i] : 0.0) + (which < 0 ? 0.0 : square(FLOATS(3)[k]) * correlation[i * n + j]);
            memcpy(columns, basis, (size_t)(n * WIDE) * sizeof(double));
            double found = restricted(covariance, columns, n, &is_sound);
            if (which < 0) out[1].d = found;
            else FLOATS(5)[k * lengths + which] = found;
        }
    }
    out[0].i = is_sound;
    free(basis);
}

/* Covariance of the errors of points that share what they stray by, in units of their own: x, y, u, u_own, covariance by
   whole pixels of distance; errors (n, n). */
LOOP(roughness_errors, "FFFFFf", "") {
    const double *x = FLOATS(0), *y = FLOATS(1), *u = FLOATS(2), *covariance = FLOATS(4);
    int64_t n = in[0].n, last = in[4].n - 1;
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = 0; j < n; j++) {
            double distance = sqrt(square(x[i] - x[j]) + square(y[i] - y[j])), part = distance - floor(distance);
            int64_t whole = (int64_t)smaller(distance, (double)last);
            FLOATS(5)[i * n + j] =
                whole >= last ? 0.0 : ((1.0 - part) * covariance[whole] + part * covariance[whole + 1]) / (u[i] * u[j]);
        }
        FLOATS(5)[i * n + i] += square(FLOATS(3)[i] / u[i]);
    }
}
