/* Point (across, along) at which the first or the last part of an outline, followed over a top, crosses a height. */
static void side_at(const int32_t *outline, int64_t n, int is_last, double height, double *across, double *along) {
    int64_t i = is_last ? n - 1 : 0, step = is_last ? -1 : 1;
    while (i + step >= 0 && i + step < n && outline[2 * i + 1] > height) i += step;
    *across = outline[2 * i];
    *along = outline[2 * i + 1];
}

/* Number of rows beyond a tip in which the finger continues with its own width. Arguments: mask with the tips up; outline
   from one side over the top to the other; row of the tip; heights below the tip between which lines are fitted to the
   sides; searched distance beyond the tip. */
LOOP(candidates_rows_beyond, "pOiddi", "i") {
    const int32_t *outline = POINTS(1);
    int64_t n = in[1].shape[0], top = in[2].i, columns = in[0].shape[1], rows = 0;
    double across[2], along[2], lean[2];
    for (int side = 0; side < 2; side++) {
        double far_across, far_along;
        side_at(outline, n, side, (double)top + in[3].d, &across[side], &along[side]);
        side_at(outline, n, side, (double)top + in[4].d, &far_across, &far_along);
        lean[side] = (across[side] - far_across) / larger(far_along - along[side], 1.0);
    }
    int first = across[0] > across[1];
    for (int64_t row = top - 2; row >= 0 && row >= top - in[5].i; row--) {
        int64_t a = (int64_t)rint(across[first] + lean[first] * (along[first] - (double)row));
        int64_t b = (int64_t)rint(across[1 - first] + lean[1 - first] * (along[1 - first] - (double)row));
        int64_t filled = 0, wide = b - a + 1;
        if (wide < 2 || a - SIDE_PX < 0 || b + SIDE_PX >= columns) continue;
        if (pixel(&in[0], row, a - SIDE_PX) || pixel(&in[0], row, b + SIDE_PX)) continue;
        for (int64_t x = a; x <= b; x++) filled += pixel(&in[0], row, x) != 0;
        rows += (double)filled >= FILLED_SHARE * (double)wide;
    }
    out[0].i = rows;
}
/* after part_removal */
/* A connected region of background: number of the region that it was joined to (its own number for none), and its extent. */
typedef struct {
    int64_t joined, left, right, top, bottom;
} Region;

static int64_t region_of(Region *regions, int64_t number) {
    while (regions[number].joined != number) number = regions[number].joined = regions[regions[number].joined].joined;
    return number;
}

/* Join two regions, and return the number of the whole; a number below zero stands for no region. */
static int64_t joined_regions(Region *regions, int64_t first, int64_t second) {
    if (first < 0) return region_of(regions, second);
    first = region_of(regions, first);
    second = region_of(regions, second);
    if (first == second) return first;
    regions[second].joined = first;
    regions[first].left = smaller_int(regions[first].left, regions[second].left);
    regions[first].right = larger_int(regions[first].right, regions[second].right);
    regions[first].top = smaller_int(regions[first].top, regions[second].top);
    regions[first].bottom = larger_int(regions[first].bottom, regions[second].bottom);
    return first;
}

/* Larger side of a region (pixels). */
static double region_size(const Region *region) {
    return (double)larger_int(region->right - region->left, region->bottom - region->top) + 1.0;
}

/* A run of background in a row: first pixel, first pixel behind it, and its region. */
typedef struct {
    int64_t start, past, region;
} GroundRun;

/* Number of background regions whose size is similar to that of the region at a place: mask, column, row; 0 if the place is
   not background. Regions are connected by sides of pixels, not by corners. */
LOOP(candidates_same_size, "Bii", "i") {
    int64_t rows = in[0].shape[0], columns = in[0].shape[1], most = columns / 2 + 1, room_for = 1024, count = 0, own = -1;
    GroundRun *runs = (GroundRun *)room(2 * most, sizeof(GroundRun)), *above = runs, *here = runs + most;
    Region *regions = (Region *)room(room_for, sizeof(Region));
    int64_t above_count = 0, same = 0;
    for (int64_t row = 0; row < rows; row++) {
        const uint8_t *line = FLAGS(0) + row * columns;
        int64_t here_count = 0, k = 0, x = 0;
        while (x < columns) {
            if (line[x]) {
                const uint8_t *off = (const uint8_t *)memchr(line + x, 0, (size_t)(columns - x));
                if (!off) break;
                x = off - line;
            }
            int64_t start = x, region = -1;
            x = past_ground(line, x, columns);
            while (k < above_count && above[k].past <= start) k++;
            for (int64_t j = k; j < above_count && above[j].start < x; j++)
                region = joined_regions(regions, region, above[j].region);
            if (region < 0) {
                if (count == room_for) {
                    regions = (Region *)realloc(regions, (size_t)(room_for *= 2) * sizeof(Region));
                    if (!regions) abort();
                }
                regions[count] = (Region){count, start, x - 1, row, row};
                region = count++;
            }
            regions[region].left = smaller_int(regions[region].left, start);
            regions[region].right = larger_int(regions[region].right, x - 1);
            regions[region].bottom = row;
            here[here_count++] = (GroundRun){start, x, region};
            if (row == in[2].i && start <= in[1].i && in[1].i < x) own = region;
        }
        GroundRun *free_room = above;
        above = here;
        above_count = here_count;
        here = free_room;
    }
    if (own >= 0) {
        double size = region_size(&regions[region_of(regions, own)]);
        for (int64_t k = 0; k < count; k++) {
            double ratio = region_size(&regions[k]) / size;
            same += regions[k].joined == k && ratio > 1.0 / SAME_SIZE && ratio < SAME_SIZE;
        }
    }
    out[0].i = same;
    free(runs);
    free(regions);
}
