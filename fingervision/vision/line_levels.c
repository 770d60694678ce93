/* Light from inside to outside, `reach` pixels to either side of the coarse edge. Beyond the picture's border the last pixel
   is repeated, because the missing part is the inside of a finger or background. Arguments: picture, light of every level,
   is_row (n), fixed, coarse, outward (k, n), step between the lines; result, values (k, n, pixels). */
LOOP(line_levels_gather, "pFBIIIif", "") {
    const Arg *upright = &in[0];
    const double *light = FLOATS(1);
    int64_t rows = upright->shape[0], columns = upright->shape[1], places = in[3].shape[1], step = in[6].i;
    int64_t pixels = in[7].shape[2], reach = pixels / 2;
    double *value = FLOATS(7);
    for (int64_t k = 0; k < in[3].shape[0]; k++)
        for (int64_t i = 0; i < places; i += step) {
            int64_t at = k * places + i, outward = INTS(5)[at], fixed = INTS(3)[at], first = INTS(4)[at] - outward * reach;
            if (FLAGS(2)[i])
                for (int64_t j = 0; j < pixels; j++, first += outward)
                    *value++ = light[pixel(upright, fixed, smaller_int(larger_int(first, 0), columns - 1))];
            else
                for (int64_t j = 0; j < pixels; j++, first += outward)
                    *value++ = light[pixel(upright, smaller_int(larger_int(first, 0), rows - 1), fixed)];
        }
}

/* Largest difference between neighbouring pixels near the centre, as a share of the difference between the ends: levels (k,
   n, pixels). */
LOOP(line_levels_steepest_shares, "Ff", "") {
    int64_t pixels = in[0].shape[2], centre = pixels / 2;
    for (int64_t i = 0; i < in[1].n; i++) {
        const double *line = FLOATS(0) + i * pixels;
        double steepest = 0.0, inside = 0.0, outside = 0.0;
        for (int64_t j = centre - NEAR_MIDDLE_PX; j <= centre + NEAR_MIDDLE_PX; j++)
            steepest = larger(steepest, 0.5 * fabs(line[j + 1] - line[j - 1]));
        for (int64_t j = 0; j < 6; j++) {
            inside += line[j];
            outside += line[pixels - 6 + j];
        }
        FLOATS(1)[i] = steepest / larger(fabs(outside - inside) / 6.0, 1.0);
    }
}

/* Position of an edge between the window's two end levels for which the window has the observed mean level. */
LOOP(line_levels_first_position, "Ff", "") {
    int64_t pixels = in[0].shape[2];
    for (int64_t i = 0; i < in[1].n; i++) {
        const double *line = FLOATS(0) + i * pixels;
        double total = 0.0;
        for (int64_t j = 0; j < pixels; j++) total += line[j];
        double outside = (line[pixels - 3] + line[pixels - 2] + line[pixels - 1]) / 3.0;
        double contrast = outside - (line[0] + line[1] + line[2]) / 3.0;
        if (fabs(contrast) < LEAST_LEVELS) contrast = LEAST_LEVELS;
        double share = (outside - total / (double)pixels) / contrast;
        FLOATS(1)[i] = within((share - 0.5) * (double)pixels, -FIRST_MOVE_PX, FIRST_MOVE_PX);
    }
}
