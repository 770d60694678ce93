/* First and last places of the tops of an outline that starts, and so ends, at its lowest point; prominences (all of them
   with room for n); how many there are.

   A top counts once the outline has gone down from it by SMALLEST_PROMINENCE_PX, a valley once it has come up by as much. */
LOOP(tops_peaks, "Ojjj", "i") {
    const int32_t *outline = POINTS(0);
    int64_t n = in[0].shape[0], *start = INTS(1), *top = INTS(2), *prominence = INTS(3), *valley = ints(n + 1), tops = 0, first = 0;
    /* The outermost place since the last valley, or the lowest since the last top. */
    int64_t extreme = 0, lowest = outline[1], is_rising = 1;
    for (int64_t place = 1; place <= n; place++) {
        int64_t i = place == n ? 0 : place, down = (int64_t)outline[2 * i + 1] - outline[2 * extreme + 1];
        if (is_rising) {
            if (down <= 0) {
                if (down != 0) first = i;
                extreme = i;
            } else if (down >= SMALLEST_PROMINENCE_PX) {
                start[tops] = first;
                top[tops] = extreme;
                valley[tops++] = lowest;
                extreme = i;
                is_rising = 0;
            }
        } else if (down > 0) {
            extreme = i;
        } else if (-down >= SMALLEST_PROMINENCE_PX) {
            lowest = outline[2 * extreme + 1];
            first = extreme = i;
            is_rising = 1;
        }
    }
    for (int64_t k = 0; k < tops; k++) {
        int64_t height = outline[2 * top[k] + 1], before = height, after = height;
        for (int64_t j = k; j >= 0; j--) {
            before = larger_int(before, valley[j]);
            if (j > 0 && outline[2 * top[j - 1] + 1] < height) break;
        }
        for (int64_t j = k + 1; j <= tops; j++) {
            after = larger_int(after, j < tops ? valley[j] : outline[1]);
            if (j < tops && outline[2 * top[j] + 1] <= height) break;
        }
        prominence[k] = smaller_int(before, after) - height;
    }
    out[0].i = tops;
    free(valley);
}
