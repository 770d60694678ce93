/* after normal_distribution */
/* Mean residual over a flank's rows. Arguments: levels (rows, pixels), offset of the edge from the window's centre,
   contrast, weight, slope, sigma; result, mean (pixels). Returns the number of rows used, their mean square residual, mean
   offset and mean contrast. */
LOOP(shared_profile_mean, "FFFFFdf", "iddd") {
    int64_t rows = in[0].shape[0], pixels = in[0].shape[1], used = 0;
    double sigma = in[5].d, total = 0.0, offsets = 0.0, contrasts = 0.0, *mean = FLOATS(6);
    double *own = floats(4 * pixels + 3), *border = own + pixels, *share = border + pixels + 1, *density = share + pixels + 1;
    memset(mean, 0, (size_t)pixels * sizeof(double));
    for (int64_t i = 0; i < rows; i++) {
        if (!(FLOATS(3)[i] > 0.0) || fabs(FLOATS(4)[i]) > STEEPEST) continue;
        const double *level = FLOATS(0) + i * pixels;
        double of_levels = 0.0, of_steps = 0.0;
        border[0] = -0.5 * (double)pixels - FLOATS(1)[i];
        for (int64_t j = 0; j < pixels; j++) border[j + 1] = border[j] + 1.0;
        for (int64_t j = 0; j <= pixels; j++) share[j] = border[j] / sigma;
        normal_at_all(share, pixels + 1, share, density);
        for (int64_t j = 0; j <= pixels; j++) share[j] = border[j] * share[j] + sigma * density[j]; /* integral of the
                                                                                                       profile at this
                                                                                                       position */
        for (int64_t j = 0; j < pixels; j++) {
            own[j] = share[j + 1] - share[j];
            of_steps += own[j];
            of_levels += level[j];
        }
        double contrast = FLOATS(2)[i], rest = (of_levels - contrast * of_steps) / (double)pixels;
        for (int64_t j = 0; j < pixels; j++) {
            double residual = level[j] - contrast * own[j] - rest;
            mean[j] += residual;
            total += residual * residual;
        }
        offsets += FLOATS(1)[i];
        contrasts += contrast;
        used++;
    }
    double count = (double)larger_int(used, 1);
    for (int64_t j = 0; j < pixels; j++) mean[j] /= count;
    out[0].i = used;
    out[1].d = total / (count * (double)pixels);
    out[2].d = offsets / count;
    out[3].d = contrasts / count;
    free(own);
}
