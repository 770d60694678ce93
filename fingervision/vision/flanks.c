/* after median */
/* Index at which the outline, followed down from its top, reaches `limit`, or index of its lowest point before it rises
   again. */
static int64_t follow_down(const int32_t *outline, int64_t n, int64_t top, int64_t step, double limit) {
    int64_t end = top, i = top;
    while (i >= 0 && i < n && outline[2 * end + 1] < limit && outline[2 * end + 1] - outline[2 * i + 1] <= TURNED_PX) {
        if (outline[2 * i + 1] > outline[2 * end + 1]) end = i;
        i += step;
    }
    return end;
}

/* Follow an outline down. Arguments: outline, index of the top, step, limit; results, index of the end, and height of the
   descent. */
LOOP(flanks_follow_down, "Oiid", "ii") {
    const int32_t *outline = POINTS(0);
    out[0].i = follow_down(outline, in[0].shape[0], in[1].i, in[2].i, in[3].d);
    out[1].i = outline[2 * out[0].i + 1] - outline[2 * in[1].i + 1];
}

/* Last crossing of every row by the outline, followed down from its top to `end`. */
LOOP(flanks_across_by_row, "Oiiif", "") {
    const int32_t *outline = POINTS(0);
    int64_t top = in[1].i, step = in[2].i, past = in[3].i + step;
    for (int64_t row = 0; row < in[4].n; row++) FLOATS(4)[row] = 0.0;
    for (int64_t i = top; i != past; i += step) {
        int64_t row = outline[2 * i + 1] - outline[2 * top + 1];
        if (row >= 0 && row < in[4].n) FLOATS(4)[row] = outline[2 * i];
    }
}

/* Median of every `stride`-th value. */
static double middle_of_some(const double *values, int64_t n, int64_t stride, double *order) {
    int64_t count = 0;
    for (int64_t i = 0; i < n; i += stride) order[count++] = values[i];
    return middle_in_place(order, count);
}

/* Whether a stretch of the given number of rows is straight: position across by row, number of rows, steepest slope. */
LOOP(flanks_has_straight_stretch, "Fid", "b") {
    const double *across = FLOATS(0);
    int64_t length = in[1].i, third = length / 3, stride = larger_int(third / ROWS_IN_A_THIRD, 1);
    double *order = floats(third + 1);
    out[0].i = 0;
    for (int64_t start = 0; start < in[0].n - length + 1 && !out[0].i; start += larger_int(length / STRETCHES, 1)) {
        double first = middle_of_some(across + start, third, stride, order);
        double last = middle_of_some(across + start + 2 * third, third, stride, order), slope = (last - first) / (2.0 * (double)third);
        if (fabs(slope) > in[2].d) continue;
        int64_t off = 0, rows = 0;
        double means[3] = {0.0, 0.0, 0.0};
        for (int k = 0; k < 3; k++) {
            int64_t count = 0;
            for (int64_t row = start + k * third; row < start + (k + 1) * third; row += stride) {
                double away = across[row] - first - slope * ((double)(row - start) - 0.5 * (double)third);
                rows++;
                if (fabs(away) > OFF_PX) {
                    off++;
                } else {
                    means[k] += away;
                    count++;
                }
            }
            means[k] /= (double)larger_int(count, 1);
        }
        out[0].i = (double)off <= MOST_OFF * (double)rows && fabs(means[1] - 0.5 * (means[0] + means[2])) <= BOW_PX;
    }
    free(order);
}
