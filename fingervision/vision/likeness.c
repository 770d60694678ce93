/* after median */
/* Width and tilt of an object, from its inner and outer side by row, and whether the picture's border cuts the object. */
LOOP(likeness_build, "FFi", "ddb") {
    const double *inner = FLOATS(0), *outer = FLOATS(1);
    int64_t high = smaller_int(in[0].n, in[1].n), cut = 0;
    int64_t first = (int64_t)(FROM_SHARE * (double)high), past = (int64_t)(TO_SHARE * (double)high);
    out[0].d = out[1].d = 0.0;
    out[2].i = 0;
    if (past - first < FEWEST_ROWS) return;
    int64_t stride = larger_int((past - first) / ROWS, 1), count = (past - first + stride - 1) / stride;
    double *width = floats(3 * count), *middles = width + count, *leans = width + 2 * count;
    for (int64_t k = 0; k < count; k++) {
        double a = inner[first + k * stride], b = outer[first + k * stride];
        width[k] = fabs(a - b) + 1.0;
        middles[k] = 0.5 * (a + b);
        cut += b <= 0.0 || b >= (double)(in[2].i - 1);
    }
    int64_t half = count / 2;
    for (int64_t k = 0; k < half; k++) leans[k] = (middles[count - half + k] - middles[k]) / (double)((count - half) * stride);
    out[0].d = middle_in_place(width, count);
    out[1].d = middle_in_place(leans, half);
    out[2].i = 2 * cut > count;
    free(width);
}
