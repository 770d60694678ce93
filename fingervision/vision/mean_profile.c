/* Sums over the pixels beside a flank, in bins of distance from its edge: picture, light of every level, rows, edge and
   slope of each row, direction outwards, reach outwards; number of pixels, their distances and their light in each bin.
   A bin's pixels are taken row by row, as they stand. */
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
