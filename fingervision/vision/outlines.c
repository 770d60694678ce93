/* A closed outline (x, y) in the fingers' axes (across, along), beginning at its lowest point. Arguments: pixels, whether
   the fingers are vertical, whether flipped, size along; result, the outline. */
LOOP(outlines_from_lowest, "OiiiO", "") {
    const int32_t *pixels = POINTS(0);
    int32_t *outline = (int32_t *)in[4].data;
    int64_t n = in[0].shape[0], axis = in[1].i ? 1 : 0, is_flipped = in[2].i, lowest = 0, i;
    for (i = 1; i < n; i++) {
        int64_t down = (int64_t)pixels[2 * i + axis] - pixels[2 * lowest + axis];
        if (is_flipped ? down < 0 : down > 0) lowest = i;
    }
    i = lowest;
    for (int64_t place = 0; place < n; place++) {
        outline[2 * place] = pixels[2 * i + 1 - axis];
        outline[2 * place + 1] = is_flipped ? (int32_t)(in[3].i - 1 - pixels[2 * i + axis]) : pixels[2 * i + axis];
        if (++i == n) i = 0;
    }
}

/* Number of columns of the widest outline, and of rows of the tallest: points (n, 2) of all outlines, start of each outline.
   */
LOOP(outlines_largest_extents, "OI", "ii") {
    const int32_t *points = POINTS(0);
    out[0].i = out[1].i = 0;
    for (int64_t number = 0; number + 1 < in[1].n; number++)
        for (int axis = 0; axis < 2; axis++) {
            int32_t least = points[2 * INTS(1)[number] + axis], most = least;
            for (int64_t i = INTS(1)[number]; i < INTS(1)[number + 1]; i++) {
                int32_t at = points[2 * i + axis];
                least = at < least ? at : least;
                most = at > most ? at : most;
            }
            out[axis].i = larger_int(out[axis].i, (int64_t)most - least + 1);
        }
}
