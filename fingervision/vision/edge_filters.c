/* Index of the nearest blur in the table. */
static int64_t filter_row(double sigma, int64_t blurs) {
    double nearest = rint(log(larger(sigma, SMALLEST_SIGMA_PX) / SMALLEST_SIGMA_PX) / log(SIGMA_RATIO));
    return (int64_t)smaller(nearest, (double)blurs - 1.0);
}

/* Index of the nearest offset in the table. */
static int64_t filter_column(double position) {
    double nearest = rint((position + LARGEST_OFFSET_PX) / OFFSET_STEP_PX);
    return (int64_t)within(nearest, 0.0, 2.0 * LARGEST_OFFSET_PX / OFFSET_STEP_PX);
}

LOOP(edge_filters_row, "di", "i") { out[0].i = filter_row(in[0].d, in[1].i); }
LOOP(edge_filters_column, "d", "i") { out[0].i = filter_column(in[0].d); }

/* One Gauss-Newton step: levels (n, pixels), slope, weight, blur_of_line, blur, start, the filters for contrast, shift and
   blur, offsets; position, contrast, blur, sigma, row, column. */
LOOP(edge_filters_look, "FFFIFFFFFFffffjj", "") {
    int64_t lines = in[0].shape[0], pixels = in[0].shape[1], blurs = in[4].n, offsets = in[6].shape[1];
    const double *slope = FLOATS(1), *weight = FLOATS(2), *blur = FLOATS(4), *start = FLOATS(5);
    const int64_t *blur_of_line = INTS(3);
    double *change = floats(2 * blurs), *count = change + blurs;
    int64_t row = 0; /* neighbouring lines often have the same slope, and hence the same filters */
    double row_sigma = -1.0;
    for (int64_t k = 0; k < 2 * blurs; k++) change[k] = 0.0;
    for (int64_t i = 0; i < lines; i++) {
        double own = blur[blur_of_line[i]], steep = square(slope[i]), stretch = 1.0 + steep;
        double sigma = sqrt(own * own * stretch + steep * PIXEL_VARIANCE);
        if (sigma != row_sigma) row = filter_row(row_sigma = sigma, in[6].shape[0]);
        int64_t column = filter_column(start[i]), at = (row * offsets + column) * pixels;
        const double *by_contrast = FLOATS(6) + at, *by_shift = FLOATS(7) + at, *by_blur = FLOATS(8) + at;
        const double *level = FLOATS(0) + i * pixels;
        int64_t seen = weight[i] > 0.0 ? pixels : 0; /* an entry without a line is not changed */
        /* With two alternating sums for each filter, an addition need not wait for the previous one. */
        double height[2] = {0.0, 0.0}, shift[2] = {0.0, 0.0}, widening[2] = {0.0, 0.0};
        int64_t j = 0;
        for (; j + 1 < seen; j += 2)
            for (int part = 0; part < 2; part++) {
                height[part] += by_contrast[j + part] * level[j + part];
                shift[part] += by_shift[j + part] * level[j + part];
                widening[part] += by_blur[j + part] * level[j + part];
            }
        for (; j < seen; j++) {
            height[0] += by_contrast[j] * level[j];
            shift[0] += by_shift[j] * level[j];
            widening[0] += by_blur[j] * level[j];
        }
        double tall = height[0] + height[1];
        double contrast = fabs(tall) >= LEAST_CONTRAST ? tall : LEAST_CONTRAST;
        double move = within((shift[0] + shift[1]) / contrast, -LARGEST_MOVE_PX, LARGEST_MOVE_PX);
        double wider = (widening[0] + widening[1]) * (sigma / (contrast * own * stretch));
        FLOATS(10)[i] = within(FLOATS(9)[column] + move, -LARGEST_OFFSET_PX, LARGEST_OFFSET_PX);
        FLOATS(11)[i] = contrast;
        FLOATS(13)[i] = sigma;
        INTS(14)[i] = row;
        INTS(15)[i] = column;
        change[blur_of_line[i]] += weight[i] * within(wider, -LARGEST_WIDENING_PX, LARGEST_WIDENING_PX);
        count[blur_of_line[i]] += weight[i];
    }
    for (int64_t k = 0; k < blurs; k++)
        FLOATS(12)[k] = within(blur[k] + change[k] / larger(count[k], 1.0), SMALLEST_BLUR_PX, LARGEST_BLUR_PX);
    free(change);
}

/* Residual of each line after a look-up: levels, position, contrast, row, column, steps, offsets, gains by row and column;
   mean square residual, and the position's gain. The table's edge is correct to an eighth of a pixel; the effect of the
   remaining offset is subtracted to first order. */
LOOP(edge_filters_mean_square, "FFFIIFFFff", "") {
    int64_t lines = in[0].shape[0], pixels = in[0].shape[1], offsets = in[5].shape[1];
    for (int64_t i = 0; i < lines; i++) {
        int64_t at = INTS(3)[i] * offsets + INTS(4)[i];
        const double *level = FLOATS(0) + i * pixels, *step = FLOATS(5) + at * pixels;
        double mean = 0.0, total = 0.0, contrast = FLOATS(2)[i], gain = FLOATS(7)[at];
        for (int64_t j = 0; j < pixels; j++) mean += level[j];
        mean /= (double)pixels;
        for (int64_t j = 0; j < pixels; j++) total += square(level[j] - mean - contrast * step[j]);
        FLOATS(8)[i] = (total - square(contrast * (FLOATS(1)[i] - FLOATS(6)[INTS(4)[i]]) * gain)) / ((double)pixels - 3.0);
        FLOATS(9)[i] = gain;
    }
}
