/* after noise_correlation */
/* Variance of the noise of every square tile after subtraction of a plane, and mean level of the tile: picture, first row
   and column of every tile (n, 2); results, variance (n), mean (n). The sums are sums of whole numbers. */
LOOP(uneven_noise_tiles, "pIff", "") {
    enum { PIXELS = SIDE_PX * SIDE_PX };
    int64_t lever = 0;
    for (int i = 0; i < SIDE_PX; i++) lever += SIDE_PX * (2 * i - SIDE_PX + 1) * (2 * i - SIDE_PX + 1);
    int is_plain = in[0].bytes == 1 && in[0].stride[1] == 1;
    for (int64_t k = 0; k < in[1].shape[0]; k++) {
        int64_t row = INTS(1)[2 * k], column = INTS(1)[2 * k + 1], sum = 0, squares = 0, by_row = 0, by_column = 0;
        for (int i = 0; i < SIDE_PX; i++) {
            int64_t own = 0;
            if (is_plain) {
                const uint8_t *at = (const uint8_t *)in[0].data + (row + i) * in[0].stride[0] + column;
                int32_t total = 0, square_total = 0, lever_total = 0;
                for (int j = 0; j < SIDE_PX; j++) {
                    int32_t value = at[j];
                    total += value;
                    square_total += value * value;
                    lever_total += (2 * j - SIDE_PX + 1) * value;
                }
                own = total;
                squares += square_total;
                by_column += lever_total;
            } else
                for (int j = 0; j < SIDE_PX; j++) {
                    int64_t value = pixel(&in[0], row + i, column + j);
                    own += value;
                    squares += value * value;
                    by_column += (2 * j - SIDE_PX + 1) * value;
                }
            sum += own;
            by_row += (2 * i - SIDE_PX + 1) * own;
        }
        double mean = (double)sum / PIXELS;
        double slopes = (square((double)by_row) + square((double)by_column)) / (double)lever;
        FLOATS(2)[k] = larger((double)squares - mean * (double)sum - slopes, 0.0) / FREE;
        FLOATS(3)[k] = mean;
    }
}
