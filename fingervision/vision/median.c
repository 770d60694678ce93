/* Upper median of a few values (Hoare's selection), which reorders the values. */
static double middle_in_place(double *a, int64_t n) {
    int64_t low = 0, high = n - 1, wanted = n / 2;
    while (low < high) {
        double pivot = a[(low + high) / 2];
        int64_t i = low, j = high;
        while (i <= j) {
            while (a[i] < pivot) i++;
            while (a[j] > pivot) j--;
            if (i <= j) {
                double kept = a[i];
                a[i++] = a[j];
                a[j--] = kept;
            }
        }
        if (wanted <= j) high = j;
        else if (wanted >= i) low = i;
        else break;
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
