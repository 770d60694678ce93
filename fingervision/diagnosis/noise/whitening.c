/* Innovations of a Kalman filter whose states are the edge's correlated noise and the smoothed input's error, both
   Ornstein-Uhlenbeck: columns (n, k), time, white variance (negative: not measured), p1, lag1, h, p2, lag2; innovations
   (n, k), and the logarithm of the determinant. */
LOOP(whitening_innovations, "FFFddFddf", "d") {
    const double *columns = FLOATS(0), *time = FLOATS(1), *white = FLOATS(2), p1 = in[3].d, lag1 = in[4].d, *h = FLOATS(5);
    double p2 = in[6].d, lag2 = in[7].d, *found = FLOATS(8), c11 = p1, c12 = 0.0, c22 = p2, logdet = 0.0;
    int64_t n = in[0].shape[0], k = in[0].shape[1];
    double *a = floats(2 * k);
    for (int64_t j = 0; j < 2 * k; j++) a[j] = 0.0;
    for (int64_t i = 0; i < n; i++) {
        if (i > 0) {
            double f1 = exp(-(time[i] - time[i - 1]) * lag1), f2 = exp(-(time[i] - time[i - 1]) * lag2);
            c11 = f1 * f1 * c11 + p1 * (1.0 - f1 * f1);
            c12 = f1 * f2 * c12;
            c22 = f2 * f2 * c22 + p2 * (1.0 - f2 * f2);
            for (int64_t j = 0; j < k; j++) {
                a[j] *= f1;
                a[k + j] *= f2;
            }
        }
        if (white[i] < 0.0) {
            for (int64_t j = 0; j < k; j++) found[i * k + j] = 0.0;
            continue;
        }
        double g1 = c11 + c12 * h[i], g2 = c12 + c22 * h[i], s = g1 + h[i] * g2 + white[i], root = sqrt(s);
        logdet += log(s);
        for (int64_t j = 0; j < k; j++) {
            double e = columns[i * k + j] - a[j] - h[i] * a[k + j];
            found[i * k + j] = e / root;
            a[j] += g1 / s * e;
            a[k + j] += g2 / s * e;
        }
        c11 -= g1 * g1 / s;
        c12 -= g1 * g2 / s;
        c22 -= g2 * g2 / s;
    }
    out[0].d = logdet;
    free(a);
}
