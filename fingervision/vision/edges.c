/* after profile_lines */
/* after median */
/* Usual level at the inner end of an inner flank's lines; 0 where there is none: levels (n, pixels), weight. */
LOOP(edges_inside, "FF", "d") {
    double seen[INNER];
    int64_t count = 0;
    for (int64_t i = 0; i < INNER; i++)
        if (FLOATS(1)[i] > 0.0) seen[count++] = FLOATS(0)[i * in[0].shape[1]];
    out[0].d = middle_in_place(seen, count);
}

/* Whether the flank itself, within 0.7 sigma and a pixel's breadth of the edge, touches the end of the scale: levels,
   position, sigma, end of the scale. Where the ground is far beyond the scale, what is left of a flank looks steep:
   sigma alone would look too near. */
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
