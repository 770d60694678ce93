/* Gaussian blur of a row, whose end values are repeated: levels, sigma; blurred levels. */
LOOP(sharpening_softened, "Fdf", "") {
    const double *levels = FLOATS(0), sigma = in[1].d;
    int64_t reach = (int64_t)ceil(3.5 * sigma), n = in[0].n;
    double *kernel = floats(2 * reach + 1), sum = 0.0;
    for (int64_t j = -reach; j <= reach; j++) sum += kernel[j + reach] = exp(-0.5 * square((double)j / sigma));
    for (int64_t j = 0; j <= 2 * reach; j++) kernel[j] /= sum;
    for (int64_t i = 0; i < n; i++) {
        double total = 0.0;
        for (int64_t j = -reach; j <= reach; j++) total += kernel[j + reach] * levels[smaller_int(larger_int(i + j, 0), n - 1)];
        FLOATS(2)[i] = total;
    }
    free(kernel);
}
