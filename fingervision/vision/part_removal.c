/* after median */
static int by_size(const void *a, const void *b) {
    double first = *(const double *)a, second = *(const double *)b;
    return (first > second) - (first < second);
}

/* Whether an object protrudes from the inner side of a finger's coarse outline: outline, sign of the inner side, first row.
   */
LOOP(part_removal_has_step, "Oid", "b") {
    const int32_t *outline = POINTS(0);
    int64_t crest = 0, count = 0, steps = 0, has_kink = 0;
    for (int64_t i = 1; i < in[0].shape[0]; i++)
        if (outline[2 * i + 1] < outline[2 * crest + 1]) crest = i;
    double *t = floats(3 * (crest + 1)), *v = t + crest + 1, *order = v + crest + 1;
    for (int64_t i = 0; i <= crest; i++) {
        double row = outline[2 * i + 1];
        if (row < in[2].d || (count && row == t[count - 1])) continue;
        t[count] = row;
        v[count++] = (double)(in[1].i * outline[2 * i]);
    }
    if (count >= 4 * STEP_ROWS) {
        int64_t half = count / 2;
        for (int64_t i = 0; i < half; i++) order[i] = (v[half + i] - v[i]) / (t[half + i] - t[i] - 0.5);
        double m = middle_in_place(order, half);
        for (int64_t i = 0; i < count; i++) order[i] = v[i] -= m * t[i];
        /* The finger's own edge is the one farthest from the gap, because a part only adds to the finger. */
        qsort(order, (size_t)count, sizeof(double), by_size);
        for (int64_t i = 0; i < count; i++) steps += v[i] - order[count / 4] > STEP_PX;
        /* A round corner recedes towards the tip, more and more steeply; a step protrudes, or is followed by a flat side. */
        for (int64_t i = STEP_ROWS; i + STEP_ROWS < count; i++)
            has_kink |= v[i + STEP_ROWS] - v[i] > STEP_PX || v[i + STEP_ROWS] - 2.0 * v[i] + v[i - STEP_ROWS] > STEP_PX;
    }
    out[0].i = count >= 4 * STEP_ROWS && steps >= STEP_ROWS && has_kink;
    free(t);
}

/* Rows in which an object touches the left side, the right side, or both. Arguments: picture, the two lines, last row;
   result, three flags for each row. Returns the number of the objects' pixels. */
LOOP(part_removal_part_rows, "Bddddibbb", "i") {
    int64_t columns = in[0].shape[1], pixels = 0;
    for (int64_t row = 0; row <= in[5].i; row++) {
        int64_t a = (int64_t)rint(in[1].d + in[2].d * (double)row), b = (int64_t)rint(in[3].d + in[4].d * (double)row);
        FLAGS(6)[row] = FLAGS(7)[row] = FLAGS(8)[row] = 0;
        if (a < 0 || b >= columns || b - a < 2 * SPECK_PX + 2) continue;
        /* Two pixels beside the line may belong to the finger's own edge. */
        int64_t first = a + 2, past = b - 1, filled = 0, left = 0, right = 0;
        const uint8_t *line = FLAGS(0) + row * columns;
        for (int64_t x = first; x < past; x++) filled += line[x] != 0;
        for (int64_t x = first; x < past && filled; x++) {
            left += line[x] && x < first + NEAR_PX;
            right += line[x] && x >= past - NEAR_PX;
        }
        pixels += filled;
        FLAGS(6)[row] = left >= SPECK_PX;
        FLAGS(7)[row] = right >= SPECK_PX;
        FLAGS(8)[row] = line[first] && line[past - 1] && 2 * filled > past - first;
    }
    out[0].i = pixels;
}

static uint8_t *flag_at(const Arg *mask, int64_t row, int64_t column) {
    return (uint8_t *)mask->data + row * mask->stride[0] + column * mask->stride[1];
}

/* Clear all pixels between the two sides, from the picture's end to the channel's end, and the remaining pixels of the part
   beside them. */
LOOP(part_removal_clear, "Pddddi", "") {
    int64_t columns = in[0].shape[1];
    for (int64_t row = 0; row <= in[5].i; row++) {
        int64_t ends[2] = {(int64_t)rint(in[1].d + in[2].d * (double)row), (int64_t)rint(in[3].d + in[4].d * (double)row)};
        for (int64_t x = larger_int(ends[0] + 1, 0); x < smaller_int(ends[1], columns); x++) *flag_at(&in[0], row, x) = 0;
        for (int side = 0; side < 2; side++) {
            int64_t at = ends[side], step = side ? 1 : -1, x = at;
            while (x >= 0 && x < columns && llabs(x - at) <= SLIVER_PX && *flag_at(&in[0], row, x)) x += step;
            if (llabs(x - at) > SLIVER_PX) continue;
            while (x != at) {
                x -= step;
                *flag_at(&in[0], row, x) = 0;
            }
        }
    }
}
