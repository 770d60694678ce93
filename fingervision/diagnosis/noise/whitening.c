/* Gains of a Kalman filter whose states are the edge's correlated noise and the smoothed input's error, both
   Ornstein-Uhlenbeck: time, white variance (negative: not measured), p1, lag1, h, p2, lag2; of each sample (n, GAINS) what the
   two states keep since the sample before (nothing at the first), the two gains, and the innovation's standard deviation
   (0: not measured); the logarithm of the determinant. */
LOOP(whitening_gains, "FFddFddf", "d") {
    const double *time = FLOATS(0), *white = FLOATS(1), p1 = in[2].d, lag1 = in[3].d, *h = FLOATS(4);
    double p2 = in[5].d, lag2 = in[6].d, c11 = p1, c12 = 0.0, c22 = p2, logdet = 0.0;
    int64_t n = in[0].n;
    for (int64_t i = 0; i < n; i++) {
        double *step = FLOATS(7) + GAINS * i, f1 = 0.0, f2 = 0.0;
        if (i > 0) {
            f1 = exp(-(time[i] - time[i - 1]) * lag1);
            f2 = exp(-(time[i] - time[i - 1]) * lag2);
            c11 = f1 * f1 * c11 + p1 * (1.0 - f1 * f1);
            c12 = f1 * f2 * c12;
            c22 = f2 * f2 * c22 + p2 * (1.0 - f2 * f2);
        }
        step[0] = f1;
        step[1] = f2;
        if (white[i] < 0.0) {
            step[2] = step[3] = step[4] = 0.0;
            continue;
        }
        double g1 = c11 + c12 * h[i], g2 = c12 + c22 * h[i], s = g1 + h[i] * g2 + white[i];
        logdet += log(s);
        step[2] = g1 / s;
        step[3] = g2 / s;
        step[4] = sqrt(s);
        c11 -= g1 * g1 / s;
        c12 -= g1 * g2 / s;
        c22 -= g2 * g2 / s;
    }
    out[0].d = logdet;
}

/* Innovations of columns (n, k) by such gains (n, GAINS), with h; innovations (n, k). */
LOOP(whitening_innovations, "FFFf", "") {
    const double *columns = FLOATS(0), *step = FLOATS(1), *h = FLOATS(2);
    double *found = FLOATS(3);
    int64_t n = in[0].shape[0], k = in[0].shape[1];
    double *a = floats(2 * k);
    for (int64_t j = 0; j < 2 * k; j++) a[j] = 0.0;
    for (int64_t i = 0; i < n; i++, step += GAINS) {
        double f1 = step[0], f2 = step[1], g1 = step[2], g2 = step[3], root = step[4];
        for (int64_t j = 0; j < k; j++) {
            a[j] *= f1;
            a[k + j] *= f2;
        }
        if (root == 0.0) {
            for (int64_t j = 0; j < k; j++) found[i * k + j] = 0.0;
            continue;
        }
        for (int64_t j = 0; j < k; j++) {
            double e = columns[i * k + j] - a[j] - h[i] * a[k + j];
            found[i * k + j] = e / root;
            a[j] += g1 * e;
            a[k + j] += g2 * e;
        }
    }
    free(a);
}
