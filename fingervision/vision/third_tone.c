/* Lines of one side of a finger that are examined, evenly distributed along the side. */
typedef struct {
    int64_t count, row[2 * MOST_ROWS + 2], edge[2 * MOST_ROWS + 2], outward;
} Side;

static Side side_of(const int64_t *fixed, const double *position, const double *weight, int64_t outward, int64_t lines) {
    Side side = {0};
    int64_t count = 0, place = 0;
    side.outward = outward;
    for (int64_t i = 0; i < lines; i++) count += weight[i] > 0.0;
    int64_t stride = larger_int(count / MOST_ROWS, 1);
    for (int64_t i = 0; i < lines && count >= FEWEST_ROWS; i++)
        if (weight[i] > 0.0 && place++ % stride == 0) {
            side.row[side.count] = fixed[i];
            side.edge[side.count++] = (int64_t)rint(position[i]);
        }
    return side;
}

/* Upper median of a few levels, found by rank: without branches that depend on the levels, it is computed twice as fast
   for noise as by selection. */
static int32_t middle_by_rank(const int32_t *levels, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        int32_t below = 0, alike = 0;
        for (int32_t j = 0; j < n; j++) {
            below += levels[j] < levels[i];
            alike += levels[j] == levels[i];
        }
        if (below <= n / 2 && n / 2 < below + alike) return levels[i];
    }
    return 0;
}

/* Compute the median level at a distance outwards from the edge; return 0 if too few rows are in the picture. */
static int level_at(const Arg *upright, const Side *side, int64_t d, double *level) {
    int32_t levels[2 * MOST_ROWS + 2], n = 0;
    for (int64_t i = 0; i < side->count; i++) {
        int64_t x = side->edge[i] + side->outward * d;
        if (x >= 0 && x < upright->shape[1]) levels[n++] = (int32_t)pixel(upright, side->row[i], x);
    }
    if (n < FEWEST_ROWS) return 0;
    *level = (double)middle_by_rank(levels, n);
    return 1;
}

/* Mean level of the step at which a strip outside (sense 1) or inside (sense -1) a side ends, and its distance from the
   edge; 0 if there is no strip. A strip between finger and background ends with a step of the same sign as the edge. */
static double strip_end(const Arg *upright, const Side *side, int64_t near, int64_t room_px, int64_t sense, double contrast,
                        double least, double *breadth) {
    double profile[REACH_PX + 1], most = least * fabs(contrast), found = 0.0;
    double way = contrast > 0.0 ? 1.0 : contrast < 0.0 ? -1.0 : 0.0;
    *breadth = 0.0;
    int64_t last = near - 1, end = sense > 0 ? smaller_int(REACH_PX, room_px) : REACH_PX;
    while (last < end && level_at(upright, side, sense * (last + 1), &profile[last + 1])) last++;
    for (int64_t d = near; d + STEP_PX <= last; d++) {
        double step = (double)sense * (profile[d + STEP_PX] - profile[d]) * way;
        if (step > most) {
            most = step;
            *breadth = d + 0.5 * STEP_PX;
            found = 0.5 * (profile[d] + profile[d + STEP_PX]);
        }
    }
    return found;
}

/* Inner and outer strip along a finger's side. Arguments: picture, fixed, position, weight and outward sign (2, PLACES),
   which finger, first and last entry of the side, least and largest distance from the edge, least step inside (share of
   the contrast); results, level at the end of the inner strip, its breadth, and the same of the outer strip. */
LOOP(third_tone_strips, "pIFFIiiiiid", "dddd") {
    int64_t first = in[5].i * in[1].shape[1] + in[6].i, near = in[8].i;
    double inside, outside;
    out[0].d = out[1].d = out[2].d = out[3].d = 0.0;
    if (near + STEP_PX > REACH_PX || near > in[9].i) return;
    Side side = side_of(INTS(1) + first, FLOATS(2) + first, FLOATS(3) + first, INTS(4)[first], in[7].i - in[6].i);
    if (!level_at(&in[0], &side, -near, &inside) || !level_at(&in[0], &side, near, &outside)) return;
    out[0].d = strip_end(&in[0], &side, near, in[9].i, -1, outside - inside, in[10].d, &out[1].d);
    out[2].d = strip_end(&in[0], &side, near, in[9].i, 1, outside - inside, LEAST_STEP, &out[3].d);
}
