/* Histogram of a large picture with 256 levels: pairs of neighbouring pixels are counted, which halves the additions, and
   the table of pairs is summed only once. */
static void count_pairs(const Arg *grey, int64_t *total) {
    int64_t rows = grey->shape[0], columns = grey->shape[1];
    uint32_t *count = (uint32_t *)room(2 * 65536, sizeof(uint32_t)), *other = count + 65536;
    memset(count, 0, 2 * 65536 * sizeof(uint32_t));
    for (int64_t row = 0; row < rows; row++) {
        const uint8_t *at = (const uint8_t *)grey->data + row * grey->stride[0];
        int64_t j = 0;
        for (; j + 8 <= columns; j += 8) {
            uint64_t eight;
            memcpy(&eight, at + j, 8);
            count[eight & 65535]++;
            other[eight >> 16 & 65535]++;
            count[eight >> 32 & 65535]++;
            other[eight >> 48]++;
        }
        for (; j < columns; j++) total[at[j]]++;
    }
    for (int64_t pair = 0; pair < 65536; pair++) {
        int64_t pairs = (int64_t)count[pair] + other[pair];
        total[pair >> 8] += pairs;
        total[pair & 255] += pairs;
    }
    free(count);
}

/* Number of pixels with each grey level. Neighbouring pixels have similar levels: with several separate counters, an
   increment need not wait for the previous one. */
LOOP(binarise_histogram, "pj", "") {
    const Arg *grey = &in[0];
    int64_t rows = grey->shape[0], columns = grey->shape[1], levels = in[1].n, *total = INTS(1);
    memset(total, 0, (size_t)levels * sizeof(int64_t));
    if (grey->bytes == 1 && levels == 256 && grey->stride[1] == 1 && rows * columns >= LARGE_PX) {
        count_pairs(grey, total);
        return;
    }
    if (grey->bytes == 1 && levels == 256) {
        enum { PARTS = 8 };
        uint32_t count[PARTS][256];
        memset(count, 0, sizeof count);
        for (int64_t row = 0; row < rows; row++) {
            const uint8_t *at = (const uint8_t *)grey->data + row * grey->stride[0];
            int64_t step = grey->stride[1], j = 0;
            for (; step == 1 && j + PARTS <= columns; j += PARTS)
                for (int part = 0; part < PARTS; part++) count[part][at[j + part]]++;
            for (; j < columns; j++) count[j % PARTS][at[j * step]]++;
        }
        for (int part = 0; part < PARTS; part++)
            for (int level = 0; level < 256; level++) total[level] += count[part][level];
        return;
    }
    for (int64_t row = 0; row < rows; row++)
        for (int64_t column = 0; column < columns; column++)
            total[smaller_int(pixel(grey, row, column), levels - 1)]++;
}

/* Otsu's threshold, the difference of the two classes' means, and this difference in units of the standard deviation within
   the classes. */
LOOP(binarise_split, "I", "idd") {
    const int64_t *histogram = INTS(0), size = in[0].n;
    double pixels = 0.0, total = 0.0, largest = 0.0, below = 0.0, sum_below = 0.0;
    int64_t threshold = 0;
    for (int64_t level = 0; level < size; level++) {
        pixels += (double)histogram[level];
        total += (double)histogram[level] * (double)level;
    }
    for (int64_t level = 0; level < size - 1; level++) {
        below += (double)histogram[level];
        sum_below += (double)histogram[level] * (double)level;
        double above = pixels - below;
        if (histogram[level] == 0 || above == 0.0) continue;
        double between = below * above * square(sum_below / below - (total - sum_below) / above);
        if (between > largest) {
            threshold = level;
            largest = between;
        }
    }
    out[0].i = threshold;
    out[1].d = out[2].d = 0.0;
    if (largest == 0.0) return;
    double means[2] = {0.0, 0.0}, variances[2] = {0.0, 0.0};
    for (int side = 0; side < 2; side++) {
        int64_t first = side ? threshold + 1 : 0, past = side ? size : threshold + 1;
        double inside = 0.0;
        for (int64_t level = first; level < past; level++) {
            inside += (double)histogram[level];
            means[side] += (double)histogram[level] * (double)level;
        }
        means[side] /= inside;
        for (int64_t level = first; level < past; level++)
            variances[side] += (double)histogram[level] * square((double)level - means[side]);
        variances[side] /= inside;
    }
    double contrast = means[1] - means[0];
    out[1].d = contrast;
    out[2].d = contrast / larger(sqrt(0.5 * (variances[0] + variances[1])), 1e-3);
}

/* Levels of one row divided by their illumination, where equality becomes half of the scale; several pixels at a time. The
   illumination is the sum of the levels around each pixel, times `share`. */
SIDE_BY_SIDE static void flatten_row(
    const uint8_t *restrict level, const int32_t *restrict sum, double share, uint8_t *restrict flat, int64_t columns
) {
    enum { AT_ONCE = 64 };
    double light[AT_ONCE], ratio[AT_ONCE];
    for (int64_t first = 0; first < columns; first += AT_ONCE) {
        int64_t count = smaller_int(columns - first, AT_ONCE);
        for (int64_t j = 0; j < count; j++) light[j] = (double)(float)((double)sum[first + j] * share);
        for (int64_t j = 0; j < count; j++) light[j] = light[j] > 1.0 ? light[j] : 1.0;
        for (int64_t j = 0; j < count; j++) ratio[j] = 128.0 * (double)level[first + j] / light[j];
        for (int64_t j = 0; j < count; j++) ratio[j] = ratio[j] < 255.0 ? ratio[j] : 255.0;
        for (int64_t j = 0; j < count; j++) flat[first + j] = (uint8_t)(int32_t)ratio[j];
    }
}

/* Picture of 8 bits divided by its illumination: picture, sums of the levels around each pixel, inverse of their number;
   result. */
LOOP(binarise_flatten_sums, "BOdb", "") {
    int64_t rows = in[0].shape[0], columns = in[0].shape[1];
    for (int64_t row = 0; row < rows; row++)
        flatten_row(FLAGS(0) + row * columns, POINTS(1) + row * columns, in[2].d, FLAGS(3) + row * columns, columns);
}

/* Picture divided by its illumination, where equality becomes half of the scale: picture, illumination (of the same size);
   result. */
LOOP(binarise_flatten, "pSb", "") {
    const float *light = (const float *)in[1].data;
    int64_t rows = in[0].shape[0], columns = in[0].shape[1];
    for (int64_t row = 0; row < rows; row++)
        for (int64_t column = 0; column < columns; column++) {
            int64_t at = row * columns + column;
            double flat = 128.0 * (double)pixel(&in[0], row, column) / (double)(light[at] > 1.0f ? light[at] : 1.0f);
            FLAGS(2)[at] = (uint8_t)smaller(flat, 255.0);
        }
}
