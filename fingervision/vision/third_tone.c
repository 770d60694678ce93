/* after median */
/* Levels half-way up the steps in which strips inside and outside of one side end; 0 where there is none: picture, fixed,
   position, weight and outward sense of the side's lines, how near to the edge, how far out.

   Only a step of the same sense as the edge itself ends a strip between finger and ground. */
LOOP(third_tone_strips, "pIFFIii", "dd") {
    const Arg *upright = &in[0];
    int64_t near = in[5].i, room_px = in[6].i, count = 0, lines = in[1].n, chosen = 0;
    int64_t *row = ints(2 * lines), *outward = row + lines;
    double *edge = floats(lines), levels[2 * MOST_ROWS + 2], profile[2 * REACH_PX + 1] = {0.0}, found[2] = {0.0, 0.0};
    uint8_t seen[2 * REACH_PX + 1] = {0};
    out[0].d = out[1].d = 0.0;
    for (int64_t i = 0; i < lines; i++) count += FLOATS(3)[i] > 0.0;
    if (count < FEWEST_ROWS || near + STEP_PX > REACH_PX) goto done;
    int64_t stride = larger_int(count / MOST_ROWS, 1), place = 0;
    for (int64_t i = 0; i < lines; i++)
        if (FLOATS(3)[i] > 0.0 && place++ % stride == 0) {
            row[chosen] = INTS(1)[i];
            outward[chosen] = INTS(4)[i];
            edge[chosen++] = rint(FLOATS(2)[i]);
        }
    for (int64_t d = -REACH_PX; d <= smaller_int(REACH_PX, room_px); d++) {
        int64_t n = 0;
        for (int64_t i = 0; i < chosen; i++) {
            int64_t x = (int64_t)edge[i] + outward[i] * d;
            if (x >= 0 && x < upright->shape[1]) levels[n++] = (double)pixel(upright, row[i], x);
        }
        if (n >= FEWEST_ROWS) {
            profile[d + REACH_PX] = middle_in_place(levels, n);
            seen[d + REACH_PX] = 1;
        }
    }
    if (!seen[REACH_PX - near] || !seen[REACH_PX + near]) goto done;
    double contrast = profile[REACH_PX + near] - profile[REACH_PX - near];
    for (int side = 0; side < 2; side++) {
        double most = LEAST_STEP * fabs(contrast), way = contrast > 0.0 ? 1.0 : contrast < 0.0 ? -1.0 : 0.0;
        int64_t sense = side ? 1 : -1;
        for (int64_t d = near; d <= REACH_PX - STEP_PX; d++) {
            int64_t a = REACH_PX + sense * d, b = REACH_PX + sense * (d + STEP_PX);
            if (!seen[a] || !seen[b]) break;
            double step = (double)sense * (profile[b] - profile[a]) * way;
            if (step > most) {
                most = step;
                found[side] = 0.5 * (profile[a] + profile[b]);
            }
        }
    }
    out[0].d = found[0];
    out[1].d = found[1];
done:
    free(row);
    free(edge);
}
