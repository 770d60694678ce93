/* after median */
/* Line v = c + m t through one side of a chain of runs (row, left, right), from slopes between points of the two halves of the
   rows (Theil and Sen), and the share of rows on the line. `order`: memory for `n` numbers. */
static void line_of_side(const int64_t *chain, int64_t n, int side, double *order, double *c, double *m, double *share) {
    int64_t half = n / 2, on = 0;
    for (int64_t i = 0; i < half; i++) {
        const int64_t *first = chain + 3 * i, *second = chain + 3 * (n - half + i);
        order[i] = (double)(second[side] - first[side]) / larger((double)(second[0] - first[0]), 1.0);
    }
    *m = middle_in_place(order, half);
    for (int64_t i = 0; i < n; i++) order[i] = (double)chain[3 * i + side] - *m * (double)chain[3 * i];
    *c = middle_in_place(order, n);
    for (int64_t i = 0; i < n; i++) on += fabs((double)chain[3 * i + side] - *c - *m * (double)chain[3 * i]) <= ON_LINE_PX;
    *share = (double)on / (double)n;
}

/* Lines through both sides of a chain of runs (n, 3), each with its share of rows on the line, and first and last row. */
LOOP(part_removal_lines, "I", "ddddddii") {
    const int64_t *chain = INTS(0), n = in[0].shape[0];
    double *order = floats(n);
    for (int side = 0; side < 2; side++)
        line_of_side(chain, n, side + 1, order, &out[3 * side].d, &out[3 * side + 1].d, &out[3 * side + 2].d);
    free(order);
    out[6].i = out[7].i = chain[0];
    for (int64_t i = 1; i < n; i++) {
        out[6].i = smaller_int(out[6].i, chain[3 * i]);
        out[7].i = larger_int(out[7].i, chain[3 * i]);
    }
}

/* Length of a run of set pixels in a row from a given pixel on; the run may begin one pixel to either side. */
static int64_t run_length(const uint8_t *line, int64_t size, int64_t i, int64_t step) {
    int64_t length = 0;
    if (i >= 0 && i < size && !line[i]) i += step;
    for (; i >= 0 && i < size && line[i]; i += step) length++;
    return length;
}

/* Median width of the objects to the left and to the right of a channel, in seven rows: picture, the two lines, first and
   last row; 0 if no row has an object. */
LOOP(part_removal_beside, "Bddddii", "dd") {
    enum { ROWS_SEEN = 9 };
    int64_t columns = in[0].shape[1];
    double left[ROWS_SEEN], right[ROWS_SEEN], step = (double)(in[6].i - in[5].i) / (ROWS_SEEN - 1.0);
    int64_t count = 0;
    for (int k = 1; k < ROWS_SEEN - 1; k++) {
        int64_t row = (int64_t)((double)k * step + (double)in[5].i);
        int64_t a = (int64_t)rint(in[1].d + in[2].d * (double)row), b = (int64_t)rint(in[3].d + in[4].d * (double)row);
        if (a < 0 || a >= b || b > columns - 1) continue;
        left[count] = (double)run_length(FLAGS(0) + row * columns, columns, a, -1);
        right[count++] = (double)run_length(FLAGS(0) + row * columns, columns, b, 1);
    }
    out[0].d = median_in_place(left, count);
    out[1].d = median_in_place(right, count);
}

/* Runs of a chain, from its end to its start: runs, index of the preceding run for each run, index of the end; chain. */
LOOP(part_removal_chain, "IIij", "") {
    int64_t i = in[2].i;
    for (int64_t k = 0; k < in[3].shape[0]; k++) {
        memcpy(INTS(3) + 3 * k, INTS(0) + 3 * i, 3 * sizeof(int64_t));
        i = INTS(1)[i];
    }
}

/* End of a run of background from a given pixel on; eight pixels are tested at a time. */
static int64_t past_ground(const uint8_t *line, int64_t x, int64_t columns) {
    uint64_t eight;
    for (; x + 8 <= columns; x += 8) {
        memcpy(&eight, line + x, 8);
        if (eight) break;
    }
    while (x < columns && !line[x]) x++;
    return x;
}

/* All runs of background between two objects (row, last pixel of the left object, first pixel of the right object), with the
   connected run below, the position in the chain, and whether a run is continued; returns the number of runs. */
LOOP(part_removal_runs, "Bjjjb", "i") {
    const uint8_t *mask = FLAGS(0);
    int64_t rows = in[0].shape[0], columns = in[0].shape[1], most = in[2].n, count = 0, below_first = 0, below_past = 0;
    int64_t *runs = INTS(1), *previous = INTS(2), *length = INTS(3);
    uint8_t *has_next = FLAGS(4);
    for (int64_t row = rows - 1; row >= 0; row--) {
        const uint8_t *line = mask + row * columns;
        int64_t first = count, x = past_ground(line, 0, columns);
        int64_t start = x;
        while (x < columns) {
            /* A run of set pixels, beginning at `start`. */
            const uint8_t *off = (const uint8_t *)memchr(line + x, 0, (size_t)(columns - x));
            x = off ? off - line : columns;
            int64_t bounded = x - start, a = x - 1;
            x = past_ground(line, x, columns);
            start = x;
            if (x == columns || x - a - 1 < LEAST_GROUND_PX || bounded < LEAST_BESIDE_PX) continue;
            int64_t end = x;
            while (end < columns && end - x < LEAST_BESIDE_PX && line[end]) end++;
            if (end - x < LEAST_BESIDE_PX) continue;
            if (count == most) {
                out[0].i = count;
                return;
            }
            runs[3 * count] = row;
            runs[3 * count + 1] = a;
            runs[3 * count + 2] = x;
            previous[count] = -1;
            length[count] = 1;
            has_next[count] = 0;
            for (int64_t k = below_first; k < below_past; k++)
                if (llabs(runs[3 * k + 1] - a) <= MOST_STEP_PX && llabs(runs[3 * k + 2] - x) <= MOST_STEP_PX) {
                    previous[count] = k;
                    length[count] = length[k] + 1;
                    has_next[k] = 1;
                }
            count++;
        }
        below_first = first;
        below_past = count;
    }
    out[0].i = count;
}
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
