/* Point at which a finger's outline, followed from its inner side, first exceeds a height. */
LOOP(way_between_inner_crossing, "Od", "dd") {
    const int32_t *outline = POINTS(0);
    int64_t i = 0;
    while (i < in[0].shape[0] - 1 && outline[2 * i + 1] > in[1].d) i++;
    out[0].d = outline[2 * i];
    out[1].d = outline[2 * i + 1];
}

/* Share of the set pixels of a mask along the path between two positions, without its ends: mask, x and y of start and end.
   */
LOOP(way_between_covered, "pdddd", "d") {
    double x0 = in[1].d, y0 = in[2].d, x1 = in[3].d, y1 = in[4].d;
    int64_t steps = (int64_t)larger(fabs(x1 - x0), fabs(y1 - y0)), covered = 0, counted = 0;
    for (int64_t k = END_PX; k <= steps - END_PX; k++) {
        int64_t x = (int64_t)rint(x0 + (x1 - x0) * (double)k / (double)steps);
        int64_t y = (int64_t)rint(y0 + (y1 - y0) * (double)k / (double)steps);
        counted++;
        covered += x >= 0 && y >= 0 && y < in[0].shape[0] && x < in[0].shape[1] && pixel(&in[0], y, x);
    }
    out[0].d = (double)covered / (double)larger_int(counted, 1);
}
