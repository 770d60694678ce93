/* Write the lines of one finger into their array entries: outline, sign of the inner side; fixed, coarse, slope, weight. */
LOOP(profile_lines_fill, "Oijjff", "") {
    const int32_t *outline = POINTS(0);
    int64_t n = in[0].shape[0], inner_sign = in[1].i, crest = 0, place;
    for (int64_t i = 1; i < n; i++)
        if (outline[2 * i + 1] < outline[2 * crest + 1]) crest = i;
    for (int side = 0; side < 3; side++) {
        int64_t first = side == 0 ? 0 : side == 1 ? INNER : ROWS, past = side == 0 ? INNER : side == 1 ? ROWS : PLACES;
        int64_t sense = side == 0 ? inner_sign : side == 1 ? -inner_sign : -1, axis = side < 2 ? 1 : 0;
        double steepest = side < 2 ? 1.0 : SLOPE_OF_A_TIP;
        int64_t begin = side == 1 ? crest : 0, end = side == 0 ? crest + 1 : n;
        int64_t lowest = outline[2 * begin + axis], highest = lowest;
        for (int64_t i = begin; i < end; i++) {
            lowest = smaller_int(lowest, outline[2 * i + axis]);
            highest = larger_int(highest, outline[2 * i + axis]);
        }
        int64_t size = highest - lowest + 1, kept = 0, *reach = ints(size), *keep = ints(size);
        double *change = floats(size);
        for (int64_t i = 0; i < size; i++) reach[i] = -FAR;
        for (int64_t i = begin; i < end; i++) {
            int64_t line = outline[2 * i + axis] - lowest;
            reach[line] = larger_int(reach[line], sense * outline[2 * i + 1 - axis]);
        }
        for (int64_t i = 0; i < size; i++) {
            int64_t low = larger_int(i - SLOPE_REACH_PX, 0), high = smaller_int(i + SLOPE_REACH_PX, size - 1);
            change[i] = (double)(sense * (reach[high] - reach[low])) / (double)larger_int(high - low, 1);
            if (fabs(change[i]) <= steepest) keep[kept++] = i;
        }
        int64_t thinning = (kept + past - first - 1) / (past - first);
        place = first;
        for (int64_t at = 0; at < kept; at += larger_int(thinning, 1)) {
            /* The columns across a tip are selected from its inner side, so that a mirrored finger has mirrored lines. The
               selected rows of a flank include even and odd rows, the two fields of an interlaced picture. */
            int64_t other = side < 2 && thinning % 2 == 0 && (place - first) % 2 == 1 && at + 1 < kept;
            int64_t i = side == 2 && inner_sign > 0 ? keep[kept - 1 - at] : keep[at + other];
            INTS(2)[place] = i + lowest;
            INTS(3)[place] = sense * reach[i];
            FLOATS(4)[place] = change[i];
            FLOATS(5)[place] = 1.0;
            place++;
        }
        free(reach);
        free(keep);
        free(change);
    }
}
