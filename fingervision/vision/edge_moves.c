/* after profile_models */
/* Subtract the structure beside the edge (shadow or glare) from the light along every line: slope, position, contrast (k,
   n), kind, sizes, breadths, blurs (k); levels (k, n, pixels). The structure is displaced with the edge and is proportional
   to the contrast. */
LOOP(edge_moves_without, "FFFiFFFf", "") {
    int64_t lines = in[7].shape[1], pixels = in[7].shape[2];
    for (int64_t at = 0; at < in[7].shape[0] * lines; at++) {
        double stretch = sqrt(1.0 + square(FLOATS(0)[at])), *level = FLOATS(7) + at * pixels;
        int64_t k = at / lines;
        for (int64_t j = 0; j < pixels; j++) {
            double away = ((double)(j - pixels / 2) - FLOATS(1)[at]) / stretch;
            level[j] -= FLOATS(2)[at] * FLOATS(4)[k] * addition(in[3].i, away, FLOATS(6)[k], FLOATS(5)[k]);
        }
    }
}
