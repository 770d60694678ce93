/* A closed outline (x, y) in the fingers' axes (across, along), from its lowest point on: pixels, whether the fingers are
   vertical, whether flipped, size along; the outline. */
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
