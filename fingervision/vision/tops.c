/* An outline that begins at its lowest point, and its local maxima (tops). */
typedef struct {
    int64_t n, tops;
    int32_t *along, *across;
    int64_t *start, *top, *valley, *prominence;
} Skyline;

/* A top is accepted if the outline descends from it by SMALLEST_PROMINENCE_PX, a valley if the outline ascends from it by
   the same amount. */
static void find_peaks(Skyline *s) {
    /* The highest point since the last valley, or the lowest point since the last top. */
    int64_t extreme = 0, lowest = s->along[0], is_rising = 1, first = 0;
    s->tops = 0;
    for (int64_t place = 1; place <= s->n; place++) {
        int64_t i = place == s->n ? 0 : place, down = (int64_t)s->along[i] - s->along[extreme];
        if (is_rising) {
            if (down <= 0) {
                if (down != 0) first = i;
                extreme = i;
            } else if (down >= SMALLEST_PROMINENCE_PX) {
                s->start[s->tops] = first;
                s->top[s->tops] = extreme;
                s->valley[s->tops++] = lowest;
                extreme = i;
                is_rising = 0;
            }
        } else if (down > 0) {
            extreme = i;
        } else if (-down >= SMALLEST_PROMINENCE_PX) {
            lowest = s->along[extreme];
            first = extreme = i;
            is_rising = 1;
        }
    }
    for (int64_t k = 0; k < s->tops; k++) {
        int64_t height = s->along[s->top[k]], before = height, after = height;
        for (int64_t j = k; j >= 0; j--) {
            before = larger_int(before, s->valley[j]);
            if (j > 0 && s->along[s->top[j - 1]] < height) break;
        }
        for (int64_t j = k + 1; j <= s->tops; j++) {
            after = larger_int(after, j < s->tops ? s->valley[j] : s->along[0]);
            if (j < s->tops && s->along[s->top[j]] <= height) break;
        }
        s->prominence[k] = smaller_int(before, after) - height;
    }
}

/* The most prominent tops of all outlines. Arguments: picture with the tips up, points (n, 2), start of each outline,
   whether the fingers are vertical, whether flipped, size along; results, outline, index on it from its lowest point,
   prominence, and whether the outline extends to the picture's lower end. Returns the number of tops. */
LOOP(tops_find, "pOIiiijjjb", "i") {
    int64_t outlines = in[2].n - 1, axis = in[3].i ? 1 : 0, size = in[5].i, most = in[6].n, count = 0, longest = 1;
    const int64_t *starts = INTS(2);
    for (int64_t number = 0; number < outlines; number++) longest = larger_int(longest, starts[number + 1] - starts[number]);
    int32_t *sky = (int32_t *)room(2 * longest, sizeof(int32_t));
    int64_t *places = ints(4 * longest + 4);
    Skyline s = {0, 0, sky, sky + longest, places, places + longest, places + 2 * longest + 1, places + 3 * longest + 2};
    for (int64_t number = 0; number < outlines; number++) {
        const int32_t *pixels = POINTS(1) + 2 * starts[number];
        int64_t lowest = 0, highest = 0;
        s.n = starts[number + 1] - starts[number];
        for (int64_t i = 1; i < s.n; i++) {
            if (pixels[2 * i + axis] > pixels[2 * lowest + axis]) lowest = i;
            if (pixels[2 * i + axis] < pixels[2 * highest + axis]) highest = i;
        }
        if (pixels[2 * lowest + axis] - pixels[2 * highest + axis] < SMALLEST_PROMINENCE_PX) continue; /* too flat for a top */
        for (int64_t place = 0, i = in[4].i ? highest : lowest; place < s.n; place++) {
            s.across[place] = pixels[2 * i + 1 - axis];
            s.along[place] = in[4].i ? (int32_t)(size - 1 - pixels[2 * i + axis]) : pixels[2 * i + axis];
            if (++i == s.n) i = 0;
        }
        find_peaks(&s);
        for (int64_t k = 0; k < s.tops; k++) {
            int64_t height = s.along[s.top[k]], between = ((int64_t)s.across[s.start[k]] + s.across[s.top[k]]) / 2;
            if (!pixel(&in[0], smaller_int(height + 2, size - 1), between)) continue; /* top of a hole, not of an object */
            int64_t at = count;
            while (at > 0 && INTS(8)[at - 1] < s.prominence[k]) at--;
            if (at == most) continue;
            if (count < most) count++;
            for (int64_t j = count - 1; j > at; j--) {
                INTS(6)[j] = INTS(6)[j - 1];
                INTS(7)[j] = INTS(7)[j - 1];
                INTS(8)[j] = INTS(8)[j - 1];
                FLAGS(9)[j] = FLAGS(9)[j - 1];
            }
            INTS(6)[at] = number;
            INTS(7)[at] = s.top[k];
            INTS(8)[at] = s.prominence[k];
            FLAGS(9)[at] = s.along[0] == size - 1 && (double)s.prominence[k] > 0.5 * (double)(s.along[0] - height);
        }
    }
    out[0].i = count;
    free(sky);
    free(places);
}
