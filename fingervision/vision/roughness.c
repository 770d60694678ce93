/* after linear_solve */
/* Replace the lower half of a matrix (n, n) by its Cholesky factor; return 0 if the matrix is not positive definite. The
   factor is computed column by column, so that the sums of a row are computed in parallel. */
static int factor(double *a, int64_t n) {
    double *column = floats(n);
    int is_positive = 1;
    for (int64_t k = 0; k < n && is_positive; k++) {
        if (!(a[k * n + k] > 0.0)) {
            is_positive = 0;
            break;
        }
        double pivot = a[k * n + k] = sqrt(a[k * n + k]);
        for (int64_t i = k + 1; i < n; i++) column[i] = a[i * n + k] /= pivot;
        for (int64_t i = k + 1; i < n; i++) {
            double *row = a + i * n, own = column[i];
            for (int64_t j = k + 1; j <= i; j++) row[j] -= own * column[j];
        }
    }
    free(column);
    return is_positive;
}

/* Solve l x = b by forward substitution: Cholesky factor l (n, n), and b (n, wide), which is replaced by x. */
static inline void forward(const double *l, int64_t n, double *b, int64_t wide) {
    for (int64_t k = 0; k < n; k++) {
        const double *known = b + k * wide;
        for (int64_t c = 0; c < wide; c++) b[k * wide + c] /= l[k * n + k];
        for (int64_t i = k + 1; i < n; i++)
            for (int64_t c = 0; c < wide; c++) b[i * wide + c] -= l[i * n + k] * known[c];
    }
}

/* Logarithm of the restricted likelihood (without a constant) of the residuals from a parabola, for points with a given
   covariance (n, n), whose lower half is overwritten: columns (n, OWN + 1), the last one the points themselves. `is_sound`
   is 0 if the covariance is not positive definite. */
static double restricted(double *covariance, double *columns, int64_t n, int *is_sound) {
    enum { WIDE = OWN + 1 };
    double normal[OWN * OWN] = {0.0}, solved[OWN] = {0.0}, lower[OWN * OWN], logarithm = 0.0, left = 0.0;
    if (!factor(covariance, n)) {
        *is_sound = 0;
        return 0.0;
    }
    for (int64_t i = 0; i < n; i++) logarithm += 2.0 * log(covariance[i * n + i]);
    forward(covariance, n, columns, WIDE);
    for (int64_t i = 0; i < n; i++)
        for (int a = 0; a < OWN; a++) {
            solved[a] += columns[i * WIDE + a] * columns[i * WIDE + OWN];
            for (int b = 0; b < OWN; b++) normal[a * OWN + b] += columns[i * WIDE + a] * columns[i * WIDE + b];
        }
    memcpy(lower, normal, sizeof lower);
    for (int a = 0; a < OWN; a++) { /* determinant by Gaussian elimination */
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

/* Logarithm of the restricted likelihood for every deviation and correlation length. Arguments: along, across, variance of
   the points, deviations, lengths; result, likelihood (deviations, lengths). Returns whether the computation succeeded, and
   the likelihood without roughness. */
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

/* Covariance of the errors of points with roughness, in units of the points' own uncertainties: x, y, u, u_own, covariance
   by whole pixels of distance; errors (n, n). */
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

/* Cholesky factor for whitening errors: covariance (n, n), which is replaced by its Cholesky factor; least variance that the
   error of a point has if those of the points before it are known. Result: whether all have it. */
LOOP(roughness_factor, "fd", "b") {
    int64_t n = in[0].shape[0];
    int is_sound = factor(FLOATS(0), n);
    for (int64_t i = 0; i < n && is_sound; i++) is_sound = square(FLOATS(0)[i * n + i]) >= in[1].d;
    out[0].i = is_sound;
}

/* Whiten correlated errors in place: Cholesky factor (n, n), columns (n, wide). */
LOOP(roughness_whiten, "Ff", "") { forward(FLOATS(0), in[0].shape[0], FLOATS(1), in[1].shape[1]); }
