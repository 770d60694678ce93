/* Move the values below a limit (`with_equal`: also those equal to it) to the front of a[first .. past), and return the first
   place behind them. The loop contains no branch that depends on the values. */
static inline int64_t to_front(double *a, int64_t first, int64_t past, double limit, int with_equal) {
    int64_t place = first;
    for (int64_t i = first; i < past; i++) {
        double own = a[i];
        a[i] = a[place];
        a[place] = own;
        place += with_equal ? own <= limit : own < limit;
    }
    return place;
}

/* Upper median of a few values (Hoare's selection), which reorders the values. */
static double middle_in_place(double *a, int64_t n) {
    int64_t first = 0, past = n, wanted = n / 2;
    while (past - first > 1) {
        double pivot = a[(first + past) / 2];
        int64_t below = to_front(a, first, past, pivot, 0);
        if (wanted < below) {
            past = below;
            continue;
        }
        int64_t up_to = to_front(a, below, past, pivot, 1);
        if (wanted < up_to || up_to == first) break; /* the latter for a value that is not a number */
        first = up_to;
    }
    return n > 0 ? a[wanted] : 0.0;
}

static double middle(const double *values, int64_t n) {
    double *a = floats(n);
    memcpy(a, values, (size_t)n * sizeof(double));
    double found = middle_in_place(a, n);
    free(a);
    return found;
}

LOOP(median_middle, "F", "d") { out[0].d = middle(FLOATS(0), in[0].n); }

/* Mean of the two central values, for an even number of values. */
static double median_in_place(double *a, int64_t n) {
    double upper = middle_in_place(a, n), lower = upper;
    if (n == 0 || n % 2) return upper;
    for (int64_t i = 0; i < n / 2; i++) lower = i == 0 ? a[0] : larger(lower, a[i]);
    return 0.5 * (lower + upper);
}

LOOP(median_median, "F", "d") {
    double *a = floats(in[0].n);
    memcpy(a, FLOATS(0), (size_t)in[0].n * sizeof(double));
    out[0].d = median_in_place(a, in[0].n);
    free(a);
}
