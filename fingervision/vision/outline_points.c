/* after profile_lines */
/* after edge_filters */
/* Points of one finger's half-level outline in the finger's own axes. Arguments: side of every entry, weight, contrast,
   fixed, position, u_position, slope, curvature gain (2, PLACES), blur (2, 2), which finger, least contrast, sign of the
   inner side, origin across and along; results, x, y, u, blur, side. Returns the number of points. The blur is the one
   (sigma_e, including the pixel) that determines the effect of the outline's curvature: blur along the edge moves the
   half-level of a curved edge, blur across the edge does not. Motion makes the blurs differ: flanks show the blur across the
   fingers, tips the blur along them. The relevant variance is that along the edge for a fixed position across the edge: det
   S / n' S n for a covariance S and the edge's normal n. The effect of a fit with free levels on a slanted line comes from
   the blur across the edge, n' S n. A short window reduces the effect on a slanted line, but not below zero. */
LOOP(outline_points_seen_from, "IFFIFFFFFididdffffj", "i") {
    int64_t k = in[9].i, first = k * PLACES, count = 0;
    const double *weight = FLOATS(1) + first, *contrast = FLOATS(2) + first, *position = FLOATS(4) + first;
    double across = square(FLOATS(8)[2 * k]) + PIXEL_VARIANCE, along = square(FLOATS(8)[2 * k + 1]) + PIXEL_VARIANCE;
    for (int64_t i = 0; i < PLACES; i++) {
        if (!(weight[i] > 0.0) || !(fabs(contrast[i]) > in[10].d)) continue;
        int is_row = INTS(0)[i] != TIP_SIDE;
        double slope = FLOATS(6)[first + i], steep = square(slope), line = (double)INTS(3)[first + i];
        double normal = (is_row ? across + along * steep : along + across * steep) / (1.0 + steep);
        FLOATS(14)[count] = (double)in[11].i * ((is_row ? position[i] : line) - in[12].d);
        FLOATS(15)[count] = (is_row ? line : position[i]) - in[13].d;
        FLOATS(16)[count] = FLOATS(5)[first + i] * (fabs(slope) > SHARED_SLOPE ? SHARED_FACTOR : 1.0);
        FLOATS(17)[count] = sqrt(larger(across * along / normal + (FLOATS(7)[first + i] - 1.0) * normal, PIXEL_VARIANCE));
        INTS(18)[count++] = INTS(0)[i];
    }
    out[0].i = count;
}
