/* One row of a patch, interpolated from a spline's coefficients: positions of the row's pixels, and levels at these
   positions. The arithmetic has single precision (seven digits), because only two digits of a level exceed the noise. */
static void sampled_row(const float *c, int64_t width, int64_t n, float *x, float *y, float *level, int32_t *at,
                        float (*across)[4], float (*down)[4]) {
    for (int64_t i = 0; i < n; i++) {
        int32_t column = (int32_t)x[i], row = (int32_t)y[i];
        float f = x[i] - (float)column, g = 1.0f - f, h = y[i] - (float)row, k = 1.0f - h;
        at[i] = (row - 1) * (int32_t)width + column - 1;
        across[i][0] = g * g * g / 6.0f + (float)CURVATURE * g;
        across[i][1] = 2.0f / 3.0f - f * f * (0.5f + 0.5f * g) + (float)CURVATURE * (3.0f * f - 2.0f);
        across[i][3] = f * f * f / 6.0f + (float)CURVATURE * f;
        across[i][2] = 1.0f - across[i][0] - across[i][1] - across[i][3];
        down[i][0] = k * k * k / 6.0f + (float)CURVATURE * k;
        down[i][1] = 2.0f / 3.0f - h * h * (0.5f + 0.5f * k) + (float)CURVATURE * (3.0f * h - 2.0f);
        down[i][3] = h * h * h / 6.0f + (float)CURVATURE * h;
        down[i][2] = 1.0f - down[i][0] - down[i][1] - down[i][3];
    }
    for (int64_t i = 0; i < n; i++) {
        const float *a = c + at[i], *w = across[i];
        float total = 0.0f;
        for (int j = 0; j < 4; j++, a += width) total += down[i][j] * (w[0] * a[0] + w[1] * a[1] + w[2] * a[2] + w[3] * a[3]);
        level[i] = total;
    }
}

/* Register one patch. Arguments: coefficients of the picture's part, levels and Jacobian of the reference (3 by number of
   pixels), inverse of its Gram matrix, number of pixels on either side across and down, initial x, y and rotation; result,
   products of gradients and residuals for each block of the patch. Returns x, y, rotation, gain, correlation, sum of squared
   residuals, and whether the iteration converged inside the part. */
LOOP(patch_registration_settled, "SSSFiidddf", "ddddddb") {
    const float *c = (const float *)in[0].data, *own = (const float *)in[1].data, *jacobian = (const float *)in[2].data;
    const double *inverse = FLOATS(3);
    int64_t height = in[0].shape[0], width = in[0].shape[1], a = in[4].i, b = in[5].i, n = 2 * a + 1, m = 2 * b + 1;
    int64_t pixels = n * m;
    double x = in[6].d, y = in[7].d, turn = in[8].d, gain = 1.0, correlation = 0.0, squares = 0.0, own_power = 0.0;
    double *scores = FLOATS(9);
    double rim = (double)larger_int(a, b);
    /* Sums of the squared positions, for the subtraction of a plane. */
    double of_x = (double)m * (double)(a * (a + 1) * n) / 3.0, of_y = (double)n * (double)(b * (b + 1) * m) / 3.0;
    float *px = (float *)room(n, sizeof(float)), *py = (float *)room(n, sizeof(float));
    float *seen = (float *)room(pixels, sizeof(float));
    float(*across)[4] = room(n, sizeof(float[4])), (*down)[4] = room(n, sizeof(float[4]));
    int32_t *at = (int32_t *)room(n, sizeof(int32_t));
    int is_settled = 0;
    for (int64_t i = 0; i < pixels; i++) own_power += (double)own[i] * own[i];
    for (int iteration = 0; iteration < ITERATIONS && !is_settled; iteration++) {
        double cosine = cos(turn), sine = sin(turn);
        double wide = fabs(cosine) * (double)a + fabs(sine) * (double)b, high = fabs(sine) * (double)a + fabs(cosine) * (double)b;
        if (!(x - wide > 1.0 + 1e-3 && y - high > 1.0 + 1e-3 && x + wide < (double)(width - 2) - 1e-3 && y + high < (double)(height - 2) - 1e-3))
            break;
        double sum = 0.0, by_x = 0.0, by_y = 0.0, power = 0.0, common = 0.0, score[3] = {0.0}, step[3];
        for (int64_t j = 0; j < m; j++) {
            float *row = seen + j * n;
            for (int64_t i = 0; i < n; i++) {
                px[i] = (float)(cosine * (double)(i - a) - sine * (double)(j - b) + x);
                py[i] = (float)(sine * (double)(i - a) + cosine * (double)(j - b) + y);
            }
            sampled_row(c, width, n, px, py, row, at, across, down);
            double of_row = 0.0;
            for (int64_t i = 0; i < n; i++) {
                of_row += row[i];
                by_x += (double)row[i] * (double)(i - a);
            }
            sum += of_row;
            by_y += of_row * (double)(j - b);
        }
        sum /= (double)pixels;
        by_x /= of_x;
        by_y /= of_y;
        for (int64_t j = 0; j < m; j++)
            for (int64_t i = 0; i < n; i++) {
                float *level = seen + j * n + i;
                *level -= (float)(sum + by_x * (double)(i - a) + by_y * (double)(j - b));
                power += (double)*level * *level;
                common += (double)*level * own[j * n + i];
            }
        gain = common / larger(power, 1e-12);
        correlation = common / sqrt(larger(power * own_power, 1e-12));
        squares = 0.0;
        for (int64_t k = 0; k < 3 * BLOCKS * BLOCKS; k++) scores[k] = 0.0;
        for (int64_t block = 0; block < BLOCKS; block++)
            for (int64_t j = block * m / BLOCKS; j < (block + 1) * m / BLOCKS; j++)
                for (int64_t beside = 0; beside < BLOCKS; beside++) {
                    double *of = scores + 3 * (block * BLOCKS + beside), part[3] = {0.0};
                    for (int64_t i = j * n + beside * n / BLOCKS; i < j * n + (beside + 1) * n / BLOCKS; i++) {
                        double left = gain * seen[i] - own[i];
                        squares += left * left;
                        part[0] += jacobian[i] * left;
                        part[1] += jacobian[pixels + i] * left;
                        part[2] += jacobian[2 * pixels + i] * left;
                    }
                    for (int k = 0; k < 3; k++) of[k] += part[k], score[k] += part[k];
                }
        for (int k = 0; k < 3; k++) step[k] = inverse[3 * k] * score[0] + inverse[3 * k + 1] * score[1] + inverse[3 * k + 2] * score[2];
        double size = larger(hypot(step[0], step[1]), rim * fabs(step[2]));
        double limit = smaller(1.0, 1.0 / larger(size, 1e-12));
        for (int k = 0; k < 3; k++) step[k] *= limit;
        /* The warp is composed with the inverse of the step: x -> R (R_s^T (x - t_s)) + t. */
        turn -= step[2];
        cosine = cos(turn);
        sine = sin(turn);
        x -= cosine * step[0] - sine * step[1];
        y -= sine * step[0] + cosine * step[1];
        is_settled = larger(size, rim * fabs(step[2])) < SETTLED_PX;
    }
    out[0].d = x;
    out[1].d = y;
    out[2].d = turn;
    out[3].d = gain;
    out[4].d = correlation;
    out[5].d = squares;
    out[6].i = is_settled;
    free(px);
    free(py);
    free(seen);
    free(across);
    free(down);
    free(at);
}
