/* after profile_lines */
/* First row and column of every square beside both inner flanks, and its side: fixed, coarse, weight (2, n), reach, rows and
   columns of the picture; squares (4 MOST_ALONG, 3). Returns the number of squares. */
LOOP(noise_correlation_squares, "IIFiiij", "i") {
    int64_t places = in[0].shape[1], reach = in[3].i, rows = in[4].i, columns = in[5].i, left = -columns, right = 2 * columns;
    int64_t count = 0;
    for (int64_t i = 0; i < INNER; i++) {
        if (FLOATS(2)[i] > 0.0) left = larger_int(left, INTS(1)[i]);
        if (FLOATS(2)[places + i] > 0.0) right = smaller_int(right, INTS(1)[places + i]);
    }
    for (int k = 0; k < 2; k++) {
        const int64_t *fixed = INTS(0) + k * places, *coarse = INTS(1) + k * places;
        const double *weight = FLOATS(2) + k * places;
        int64_t low[MOST_ALONG], high[MOST_ALONG], top = rows;
        for (int along = 0; along < MOST_ALONG; along++) {
            low[along] = columns;
            high[along] = -1;
        }
        for (int64_t i = 0; i < INNER; i++)
            if (weight[i] > 0.0) top = smaller_int(top, fixed[i]);
        for (int64_t i = 0; i < INNER; i++) {
            int64_t along = (fixed[i] - top) / SIDE_PX;
            if (!(weight[i] > 0.0) || along >= MOST_ALONG) continue;
            low[along] = smaller_int(low[along], coarse[i]);
            high[along] = larger_int(high[along], coarse[i]);
        }
        for (int along = 0; along < MOST_ALONG; along++) {
            int64_t first = top + along * SIDE_PX;
            if (high[along] < 0 || first + SIDE_PX > rows) continue;
            /* The background lies at larger columns for the left finger, and at smaller columns for the right finger. */
            for (int end = 0; end < 2; end++) {
                int64_t start = end ? low[along] - reach - BEYOND_PX - SIDE_PX + 1 : high[along] + reach + BEYOND_PX;
                int64_t side = (end == 0) == (k == 0) ? GROUND : FINGER;
                if (side == GROUND && (k == 0 ? start + SIDE_PX > right - reach : start < left + reach))
                    continue; /* the square contains the other finger's edge */
                if (start < 0 || start > columns - SIDE_PX) continue;
                INTS(6)[3 * count] = first;
                INTS(6)[3 * count + 1] = start;
                INTS(6)[3 * count + 2] = side;
                count++;
            }
        }
    }
    out[0].i = count;
}

/* Sum of the squares' autocovariances, each after subtraction of a plane of light. Arguments: picture, light, squares (n,
   3), the chosen side, the largest lag; result, covariance (7, 7). Returns the number of pixels. The first index is the lag
   along a row plus LAGS, the second index is the lag in rows; entries beyond the largest lag stay zero. */
LOOP(noise_correlation_autocovariance, "pFIiif", "d") {
    enum { WIDE = 2 * LAGS + 1, PIXELS = SIDE_PX * SIDE_PX };
    int64_t n = 0, used = 0, farthest = in[4].i;
    double *squares = floats(in[2].shape[0] * PIXELS), *power = floats(in[2].shape[0]), *covariance = FLOATS(5), least = 0.0;
    double middle_of_side = 0.5 * (SIDE_PX - 1), mean_square = (PIXELS - 1.0) / 12.0;
    memset(covariance, 0, WIDE * WIDE * sizeof(double));
    for (int64_t k = 0; k < in[2].shape[0]; k++) {
        const int64_t *corner_at = INTS(2) + 3 * k;
        if (corner_at[2] != in[3].i) continue;
        double *own = squares + n * PIXELS, mean = 0.0, by_row = 0.0, by_column = 0.0, total = 0.0;
        for (int i = 0; i < SIDE_PX; i++)
            for (int j = 0; j < SIDE_PX; j++) {
                double value = FLOATS(1)[pixel(&in[0], corner_at[0] + i, corner_at[1] + j)];
                own[i * SIDE_PX + j] = value;
                mean += value;
                by_row += value * (i - middle_of_side);
                by_column += value * (j - middle_of_side);
            }
        mean /= PIXELS;
        by_row = by_row / PIXELS / mean_square;
        by_column = by_column / PIXELS / mean_square;
        for (int i = 0; i < SIDE_PX; i++)
            for (int j = 0; j < SIDE_PX; j++) {
                own[i * SIDE_PX + j] -= mean + by_row * (i - middle_of_side) + by_column * (j - middle_of_side);
                total += square(own[i * SIDE_PX + j]);
            }
        power[n] = total;
        least = n ? smaller(least, total) : total;
        n++;
    }
    /* Several squares are computed in parallel, each with its own sums, so that an addition need not wait for the previous
       one. */
    enum { AT_ONCE = 4 };
    double *beside = floats(AT_ONCE * PIXELS);
    for (int64_t k = 0; k < n;) {
        int64_t count = 0;
        memset(beside, 0, AT_ONCE * PIXELS * sizeof(double));
        for (; k < n && count < AT_ONCE; k++) {
            if (power[k] > QUIETEST_TIMES * least) continue;
            for (int64_t at = 0; at < PIXELS; at++) beside[at * AT_ONCE + count] = squares[k * PIXELS + at];
            count++;
        }
        used += count;
        for (int64_t down = 0; down <= farthest; down++)
            for (int64_t right = -farthest; right <= farthest; right++) {
                if (down == 0 && right < 0) continue;
                double total[AT_ONCE] = {0.0};
                for (int64_t i = 0; i < SIDE_PX - down; i++)
                    for (int64_t j = larger_int(-right, 0); j < SIDE_PX - larger_int(right, 0); j++) {
                        const double *here = beside + (i * SIDE_PX + j) * AT_ONCE;
                        const double *there = here + (down * SIDE_PX + right) * AT_ONCE;
                        for (int part = 0; part < AT_ONCE; part++) total[part] += here[part] * there[part];
                    }
                /* Larger lags have fewer pairs of pixels: each sum is scaled to one pair per pixel. */
                int64_t pairs = (SIDE_PX - down) * (SIDE_PX - llabs(right));
                for (int64_t part = 0; part < count; part++)
                    covariance[(LAGS + right) * WIDE + LAGS + down] += total[part] * PIXELS / (double)pairs;
            }
    }
    free(beside);
    for (int down = 0; down <= LAGS; down++)
        for (int right = -LAGS; right <= LAGS; right++)
            covariance[(LAGS - right) * WIDE + LAGS - down] = covariance[(LAGS + right) * WIDE + LAGS + down];
    out[0].d = (double)(used * PIXELS);
    free(squares);
    free(power);
}

/* Variance of a mean over lines divided by its value for lines with independent noise; each line is a sum weighted by
   `weight`. */
LOOP(noise_correlation_shared, "FF", "d") {
    enum { WIDE = 2 * LAGS + 1 };
    int64_t n = in[1].n;
    double alone = 0.0, together = 0.0;
    for (int64_t lag = -LAGS; lag <= LAGS; lag++) {
        double sum = 0.0;
        for (int64_t j = larger_int(-lag, 0); j < n - larger_int(lag, 0); j++) sum += FLOATS(1)[j] * FLOATS(1)[j + lag];
        alone += sum * FLOATS(0)[(LAGS + lag) * WIDE + LAGS];
        for (int line_lag = 0; line_lag < WIDE; line_lag++) together += sum * FLOATS(0)[(LAGS + lag) * WIDE + line_lag];
    }
    out[0].d = together / larger(alone, 1e-12);
}
