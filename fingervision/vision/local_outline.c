/* after finger_end */
/* after median */
/* after linear_solve */
enum { TERMS = DEGREE + 1 };

static double power_sum(const double *c, double s) {
    double total = 0.0, power = 1.0;
    for (int a = 0; a < TERMS; a++, power *= s) total += c[a] * power;
    return total;
}

/* Polynomial of the normal over the tangential distance near a position, by weighted least squares with Tukey's biweight: x,
   y, u, is_row, centre, normal, reach; coefficients, variance at the centre, spread. Returns whether there is a polynomial.
   */
LOOP(local_outline_polynomial, "FFFBdddddf", "bdd") {
    int64_t n = 0;
    double nx = in[6].d, ny = in[7].d, reach = in[8].d, *c = FLOATS(9), inverse[TERMS * TERMS], right[TERMS];
    double *s = floats(6 * in[0].n), *away = s + in[0].n, *taper = away + in[0].n, *u = taper + in[0].n;
    double *weight = u + in[0].n, *order = weight + in[0].n;
    out[0].i = 0;
    out[1].d = out[2].d = 0.0;
    for (int64_t i = 0; i < in[0].n; i++) {
        double dx = FLOATS(0)[i] - in[4].d, dy = FLOATS(1)[i] - in[5].d, t = (-dx * ny + dy * nx) / reach, d = dx * nx + dy * ny;
        double rest = 1.0 - fabs(t * t * t);
        if (!(rest > 0.0) || !(fabs(d) < reach)) continue;
        s[n] = t;
        away[n] = d;
        taper[n] = rest * rest * rest;
        /* A displacement along a row, times the normal's component along the row, is the displacement along the normal. */
        u[n] = FLOATS(2)[i] * larger(fabs(FLAGS(3)[i] ? nx : ny), 0.3);
        weight[n] = taper[n] / square(u[n]);
        n++;
    }
    if (n < FEWEST_POINTS) goto done;
    for (int iteration = 0; iteration < 4; iteration++) {
        /* All elements of a polynomial's normal matrix are sums of powers up to twice the degree. */
        double matrix[TERMS * TERMS], sums[2 * TERMS - 1] = {0.0};
        for (int a = 0; a < TERMS; a++) right[a] = 0.0;
        for (int64_t i = 0; i < n; i++) {
            double power = weight[i];
            for (int a = 0; a < 2 * TERMS - 1; a++, power *= s[i]) {
                sums[a] += power;
                if (a < TERMS) right[a] += power * away[i];
            }
        }
        for (int a = 0; a < TERMS; a++)
            for (int b = 0; b < TERMS; b++) {
                matrix[a * TERMS + b] = sums[a + b];
                inverse[a * TERMS + b] = a == b;
            }
        if (!solve(matrix, TERMS, inverse, TERMS)) goto done; /* too few positions to determine the coefficients */
        for (int a = 0; a < TERMS; a++) {
            c[a] = 0.0;
            for (int b = 0; b < TERMS; b++) c[a] += inverse[a * TERMS + b] * right[b];
        }
        if (iteration == 3) break;
        for (int64_t i = 0; i < n; i++) order[i] = fabs(away[i] - power_sum(c, s[i])) / u[i];
        double cut = BIWEIGHT_REACH * larger(1.4826 * median_in_place(order, n), LEAST_SPREAD);
        for (int64_t i = 0; i < n; i++) {
            double rest = larger(1.0 - square((away[i] - power_sum(c, s[i])) / u[i] / cut), 0.0);
            weight[i] = taper[i] * rest * rest / square(u[i]);
        }
    }
    double total = 0.0, squares = 0.0, left = 0.0, own = 0.0, variance = 0.0;
    for (int64_t i = 0; i < n; i++) {
        total += weight[i];
        squares += square(weight[i]);
        left += weight[i] * square(away[i] - power_sum(c, s[i]));
        own += weight[i] * square(u[i]);
        variance += square(power_sum(inverse, s[i]) * weight[i] * u[i]);
    }
    double effective = square(total) / squares;
    if (!(effective > DEGREE + 2)) goto done;
    /* If there are only as many points as coefficients, the spread is unknown. */
    out[2].d = sqrt(left / own) * sqrt(effective / (effective - DEGREE - 1.0));
    out[1].d = variance;
    out[0].i = 1;
    double scale = 1.0;
    for (int a = 0; a < TERMS; a++, scale *= reach) c[a] /= scale;
done:
    free(s);
}
