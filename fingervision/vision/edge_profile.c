/* after linear_solve */
/* after normal_distribution */
/* after median */
/* Find a deviation from a blurred step (a mark) in one flank: levels (rows, pixels), position, sigma, contrast, mean_square,
   noise, end of the scale; possible displacement of the edge, and amount beyond the end of the scale. */
LOOP(edge_profile_edge_mark, "FFFFFdd", "dd") {
    static const double RIMS[] = RIM_PX, BEYONDS[] = BEYOND;
    const double *position = FLOATS(1), *sigma = FLOATS(2), *contrast = FLOATS(3), *mean_square = FLOATS(4);
    double noise = in[5].d, top_level = in[6].d, gram[MARKS][MARKS] = {{0.0}}, seen[MARKS] = {0.0}, mark[MARKS];
    int64_t rows = in[0].shape[0], pixels = in[0].shape[1], used = 0, at_end = 0;
    double blur = 0.0, height = 0.0, *size_of = floats(rows);
    out[0].d = out[1].d = 0.0;
    for (int64_t i = 0; i < rows; i++) size_of[i] = fabs(contrast[i]);
    double usual = middle_in_place(size_of, rows);
    free(size_of);
    for (int64_t i = rows / 2; i < rows; i += THINNING) {
        if (mean_square[i] > DUSTY * noise * noise || fabs(contrast[i]) < LEAST_CONTRAST * usual) continue;
        const double *level = FLOATS(0) + i * pixels;
        double width = sqrt(square(sigma[i]) + 1.0 / 12.0), least = level[0], most = level[0];
        for (int64_t j = 1; j < pixels; j++) {
            least = smaller(least, level[j]);
            most = larger(most, level[j]);
        }
        used++;
        at_end += least <= 0.0 || most >= top_level;
        blur += width;
        height += fabs(contrast[i]);
        for (int64_t j = 0; j < pixels; j++) {
            double away = (double)(j - pixels / 2) - position[i], t = away / width;
            double density, other, step = normal(t, &density), share = level[j] / contrast[i];
            mark[0] = 1.0;
            mark[1] = step;
            mark[2] = density;
            mark[3] = t * density;
            for (int k = 0; k < RIM_PX_COUNT; k++)
                mark[FITTED + k] = step - normal((away - RIMS[k]) / width, &other);
            for (int k = 0; k < BEYOND_COUNT; k++)
                mark[FITTED + RIM_PX_COUNT + k] = smaller((1.0 + BEYONDS[k]) * step, 1.0) - step;
            for (int a = 0; a < MARKS; a++) {
                seen[a] += mark[a] * share;
                for (int b = 0; b <= a; b++) gram[a][b] += mark[a] * mark[b];
            }
        }
    }
    if (used < FEWEST_ROWS) return;
    blur /= (double)used;
    height /= (double)used;
    for (int a = 0; a < MARKS; a++)
        for (int b = 0; b < a; b++) gram[b][a] = gram[a][b];
    /* Part of each mark that the fit absorbs as level, contrast, position and blur. */
    double fitted[FITTED * FITTED], taken_up[FITTED * (MARKS - FITTED)];
    enum { OTHERS = MARKS - FITTED };
    for (int a = 0; a < FITTED; a++)
        for (int b = 0; b < MARKS; b++) {
            if (b < FITTED) fitted[a * FITTED + b] = gram[a][b];
            else taken_up[a * OTHERS + b - FITTED] = gram[a][b];
        }
    if (!solve(fitted, FITTED, taken_up, OTHERS)) return; /* equal rows contain no information for the test */
    /* If a level of the window reaches the end of the scale, the mark may be clipping; otherwise clipping is impossible. */
    int is_cut = 2 * at_end > used;
    double best = SIGNIFICANT * square(noise / height), shift = 0.0, beyond = 0.0;
    for (int k = is_cut ? RIM_PX_COUNT : 0; k < (is_cut ? OTHERS : RIM_PX_COUNT); k++) {
        int at = FITTED + k;
        double left = seen[at], own = gram[at][at];
        for (int a = 0; a < FITTED; a++) {
            left -= taken_up[a * OTHERS + k] * seen[a];
            own -= taken_up[a * OTHERS + k] * gram[a][at];
        }
        own = larger(own, LEAST_OWN * gram[at][at]);
        double size = left / own, u_size = noise / (height * sqrt(own)), moves = -taken_up[POSITION * OTHERS + k] * blur;
        if (is_cut) { /* largest possible size, with its uncertainty */
            shift = smaller(shift, moves * larger(size + u_size, 0.0));
            beyond = larger(beyond, BEYONDS[k - RIM_PX_COUNT] * (size - SURE_SIGMAS * u_size));
        } else if (left * size > best && fabs(size) > LEAST_SHARE) {
            best = left * size;
            shift = moves * size;
        }
    }
    if (is_cut && blur < HIDING_BLUR_PX) shift = smaller(shift, -HIDDEN_SHIFT_PX);
    out[0].d = shift;
    out[1].d = beyond;
}
