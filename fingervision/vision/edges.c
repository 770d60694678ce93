/* after profile_lines */
/* after median */
/* Median level at the inner end of the lines across an inner flank; 0 if there are no lines: levels (n, pixels), weight. */
LOOP(edges_inside, "FF", "d") {
    double seen[INNER];
    int64_t count = 0;
    for (int64_t i = 0; i < INNER; i++)
        if (FLOATS(1)[i] > 0.0) seen[count++] = FLOATS(0)[i * in[0].shape[1]];
    out[0].d = middle_in_place(seen, count);
}

/* Whether the flank within 0.7 sigma plus one pixel of the edge reaches the end of the scale: levels, position, sigma, end
   of the scale. If the background is far beyond the scale, the unclipped part of the flank looks steep, so that sigma alone
   would give too short a distance. */
LOOP(edges_clipped, "FFFdb", "") {
    int64_t lines = in[0].shape[0], pixels = in[0].shape[1];
    for (int64_t i = 0; i < lines; i++) {
        const double *level = FLOATS(0) + i * pixels;
        double near = larger(0.7 * FLOATS(2)[i], 0.8);
        FLAGS(4)[i] = 0;
        for (int64_t j = 0; j < pixels; j++)
            if (fabs((double)(j - pixels / 2) - FLOATS(1)[i]) < near && (level[j] <= 0.0 || level[j] >= in[3].d)) FLAGS(4)[i] = 1;
    }
}
