/* after profile_lines */
/* after median */
/* Displacement to the right of a finger's flanks in the even rows relative to the odd rows; 0 if they agree. */
LOOP(interlace_apart, "IFF", "d") {
    const int64_t *fixed = INTS(0);
    const double *position = FLOATS(1), *weight = FLOATS(2);
    double found[ROWS], order[ROWS], total = 0.0;
    int64_t count = 0, used = 0;
    out[0].d = 0.0;
    for (int b = 1; b < ROWS - 1; b++) {
        int a = b - 1, c = b + 1;
        if (weight[a] == 0.0 || weight[b] == 0.0 || weight[c] == 0.0) continue;
        int64_t before = fixed[b] - fixed[a], after = fixed[c] - fixed[b];
        if (before * after <= 0 || before % 2 == 0 || after % 2 == 0 || llabs(before) > NEAR_PX || llabs(after) > NEAR_PX) continue;
        double between = (position[a] * (double)after + position[c] * (double)before) / (double)(before + after);
        found[count++] = (position[b] - between) * (fixed[b] % 2 == 0 ? 1.0 : -1.0);
    }
    if (count < FEWEST_ROWS) return;
    memcpy(order, found, sizeof order);
    double usual = middle_in_place(order, count);
    for (int64_t i = 0; i < count; i++) order[i] = fabs(found[i] - usual);
    double spread = SIGMAS_IN_MEDIAN * middle_in_place(order, count) + 1e-6;
    for (int64_t i = 0; i < count; i++)
        if (fabs(found[i] - usual) < DUST * spread) {
            total += found[i];
            used++;
        }
    double mean = total / (double)larger_int(used, 1);
    /* A row minus the mean of two rows has 3/2 of a row's variance; the difference of the means of two halves of n rows has
       4/n of a row's variance. */
    double u_mean = SHARED * spread * sqrt(4.0 / 1.5 / (double)larger_int(used, 1));
    if (fabs(mean) > larger(SURE * u_mean, LEAST_PX)) out[0].d = mean;
}
