/* after profile_lines */
/* after normal_distribution */
/* Rows of one flank: levels (rows, pixels), position of the edge and the window's centre, outward sign, contrast, weight,
   slope; the blur. */
typedef struct {
    const double *level, *position, *contrast, *weight, *slope;
    const int64_t *coarse, *outward;
    int64_t rows, pixels;
    double sigma;
} FlankRows;

/* Mean residual over a flank's rows; `found`: number of rows used, their mean square residual, mean offset of the edge from
   the window's centre, and mean contrast. */
static void mean_residual(const FlankRows *flank, double *mean, double *found) {
    int64_t rows = flank->rows, pixels = flank->pixels, used = 0;
    double sigma = flank->sigma, total = 0.0, offsets = 0.0, contrasts = 0.0;
    double *own = floats(4 * pixels + 3), *border = own + pixels, *share = border + pixels + 1, *density = share + pixels + 1;
    memset(mean, 0, (size_t)pixels * sizeof(double));
    for (int64_t i = 0; i < rows; i++) {
        if (!(flank->weight[i] > 0.0) || fabs(flank->slope[i]) > STEEPEST) continue;
        const double *level = flank->level + i * pixels;
        double offset = (flank->position[i] - (double)flank->coarse[i]) * (double)flank->outward[i];
        double of_levels = 0.0, of_steps = 0.0;
        border[0] = -0.5 * (double)pixels - offset;
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
        double contrast = flank->contrast[i], rest = (of_levels - contrast * of_steps) / (double)pixels;
        for (int64_t j = 0; j < pixels; j++) {
            double residual = level[j] - contrast * own[j] - rest;
            mean[j] += residual;
            total += residual * residual;
        }
        offsets += offset;
        contrasts += contrast;
        used++;
    }
    double count = (double)larger_int(used, 1);
    for (int64_t j = 0; j < pixels; j++) mean[j] /= count;
    found[0] = (double)used;
    found[1] = total / (count * (double)pixels);
    found[2] = offsets / count;
    found[3] = contrasts / count;
    free(own);
}

/* Mean residuals over the rows of all flanks: levels (2, PLACES, pixels), position, coarse, outward, contrast, weight, slope
   (2, PLACES), blur (2, 2); results, mean (2, 2, pixels), and for each flank the number of rows used, their mean square
   residual, mean offset and mean contrast (2, 2, 4). The inner flank of a finger comes before its outer flank. */
LOOP(shared_profile_means, "FFIIFFFFff", "") {
    int64_t places = in[0].shape[1], pixels = in[0].shape[2];
    for (int finger = 0; finger < 2; finger++)
        for (int side = 0; side < 2; side++) {
            int64_t at = finger * places + (side ? INNER : 0), flank = 2 * finger + side;
            FlankRows rows = {FLOATS(0) + at * pixels, FLOATS(1) + at, FLOATS(4) + at, FLOATS(5) + at, FLOATS(6) + at,
                              INTS(2) + at, INTS(3) + at, side ? ROWS - INNER : INNER, pixels, FLOATS(7)[2 * finger]};
            mean_residual(&rows, FLOATS(8) + flank * pixels, FLOATS(9) + 4 * flank);
        }
}
