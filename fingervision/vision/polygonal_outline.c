/* Smallest sum of squared distances of points from a straight line, from their sums of weights, positions and products. */
static double squares_about_line(const double *m) {
    double weight = larger(m[0], 1e-300);
    double xx = m[3] - m[1] * m[1] / weight, xy = m[4] - m[1] * m[2] / weight, yy = m[5] - m[2] * m[2] / weight;
    return larger(0.5 * (xx + yy - hypot(xx - yy, 2.0 * xy)), 0.0);
}

/* Smallest sum of squared distances for the points `first` to `last` (exclusive) of a chain whose sums are cumulative, six
   for every point. */
static double squares_of_run(const double *sums, int64_t first, int64_t last) {
    double m[6];
    for (int a = 0; a < 6; a++) m[a] = sums[6 * last + a] - sums[6 * first + a];
    return squares_about_line(m);
}

LOOP(polygonal_outline_squares, "F", "d") { out[0].d = squares_about_line(FLOATS(0)); }

/* Sums of squares of all runs of FEWEST_OF_RUN points: cumulative sums (n + 1, 6); sums of squares (n - FEWEST_OF_RUN + 1).
   */
LOOP(polygonal_outline_windows, "Ff", "") {
    for (int64_t first = 0; first < in[1].n; first++)
        FLOATS(1)[first] = squares_of_run(FLOATS(0), first, first + FEWEST_OF_RUN);
}

/* Division of the first k points with the lowest cost, for every k. Arguments: cumulative sums (n + 1, 6), noise; result,
   for every k the start of the last run, or -1 if the last point is left out (n + 1). */
LOOP(polygonal_outline_cheapest, "Fdj", "") {
    int64_t n = in[2].n - 1, *last_run = INTS(2);
    double *cost = floats(n + 1);
    cost[0] = 0.0;
    last_run[0] = -1;
    for (int64_t k = 1; k <= n; k++) {
        double least = 0.0;
        int64_t best = -1;
        for (int64_t first = 0; first + FEWEST_OF_RUN <= k; first++) {
            double by_run = cost[first] + squares_of_run(FLOATS(0), first, k) / in[1].d + PRICE_OF_RUN;
            if (best >= 0 && !(by_run < least)) continue;
            least = by_run;
            best = first;
        }
        cost[k] = cost[k - 1] + PRICE_OF_POINT;
        last_run[k] = -1;
        if (best >= 0 && least < cost[k]) {
            cost[k] = least;
            last_run[k] = best;
        }
    }
    free(cost);
}
