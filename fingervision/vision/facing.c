/* after profile_lines */
/* Whether all inner lines of the left finger lie at least a given number of pixels to the left of those of the right finger,
   or one finger has no lines: last pixel and weight of every line (2, PLACES), the distance. Lines occupy the first entries
   of their arrays. */
LOOP(facing_are_apart, "IFi", "b") {
    int64_t places = in[0].shape[1], ends[2] = {0, 0};
    for (int k = 0; k < 2; k++) {
        const int64_t *coarse = INTS(0) + k * places;
        const double *weight = FLOATS(1) + k * places;
        int64_t filled = 0;
        double seen = 0.0;
        for (int64_t i = 0; i < INNER; i++) seen += weight[i];
        filled = (int64_t)seen;
        if (filled == 0) {
            out[0].i = 1;
            return;
        }
        ends[k] = coarse[0];
        for (int64_t i = 1; i < filled; i++) ends[k] = k ? smaller_int(ends[k], coarse[i]) : larger_int(ends[k], coarse[i]);
    }
    out[0].i = ends[1] - ends[0] >= in[2].i;
}
