/* after median */
/* after first_guess */
/* Line through the edges of a flank's rows, without rows with dust: rows, edges; which rows are kept (initially all).
   Returns their number, intercept, slope, and the spread of the rows to which the last line was fitted. */
LOOP(mean_profile_robust_line, "IFb", "iddd") {
    int64_t n = in[0].n, kept = n;
    double *t = floats(3 * n), *v = t + n, *away = v + n, intercept = 0.0, slope = 0.0, spread = 0.0;
    for (int look = 0; look < LOOKS && kept >= FEWEST_ROWS; look++) {
        kept = 0;
        for (int64_t i = 0; i < n; i++)
            if (FLAGS(2)[i]) {
                t[kept] = (double)INTS(0)[i];
                v[kept++] = FLOATS(1)[i];
            }
        line(t, v, kept, &intercept, &slope);
        for (int64_t i = 0; i < kept; i++) away[i] = fabs(v[i] - (intercept + slope * t[i]));
        spread = SIGMAS_IN_MEDIAN * median_in_place(away, kept);
        kept = 0;
        for (int64_t i = 0; i < n; i++) {
            double off = fabs(FLOATS(1)[i] - (intercept + slope * (double)INTS(0)[i]));
            kept += FLAGS(2)[i] = off < DUST * spread + LEAST_DUST_PX;
        }
    }
    out[0].i = kept;
    out[1].d = intercept;
    out[2].d = slope;
    out[3].d = spread;
    free(t);
}

/* Sums over the pixels beside a flank, in bins of the distance from its edge. Arguments: picture, light of every level,
   rows, edge and slope of each row, outward direction, outward reach; results, for each bin the number of pixels, and the
   sums of their distances and of their light. Pixels are read row by row, in the order of the memory. */
LOOP(mean_profile_bins, "pFIFFiifff", "") {
    const Arg *picture = &in[0];
    const double *light = FLOATS(1), *edge = FLOATS(3), *slope = FLOATS(4);
    const int64_t *rows = INTS(2), outward = in[5].i, room_px = in[6].i, bins = in[7].n, columns = picture->shape[1];
    double *count = FLOATS(7), *distance = FLOATS(8), *total = FLOATS(9);
    for (int64_t i = 0; i < bins; i++) count[i] = distance[i] = total[i] = 0.0;
    for (int64_t k = 0; k < in[2].n; k++) {
        int64_t nearest = (int64_t)rint(edge[k]);
        double stretch = hypot(1.0, slope[k]);
        for (int64_t step = -(int64_t)REACH_PX; step <= room_px; step++) {
            int64_t column = nearest + outward * step;
            if (column < 0 || column >= columns) continue;
            double t = (double)outward * ((double)column - edge[k]) / stretch;
            int64_t bin = (int64_t)floor(t / BIN_PX) + (int64_t)(2.0 * REACH_PX / BIN_PX);
            if (bin < 0 || bin >= bins) continue;
            count[bin] += 1.0;
            distance[bin] += t;
            total[bin] += light[pixel(picture, rows[k], column)];
        }
    }
}
