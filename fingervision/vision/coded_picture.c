/* Stored level, interpolated in an increasing table, that corresponds to a given light. */
static double stored_level(const double *light, int64_t levels, double wanted) {
    int64_t low = 0, high = levels - 1;
    if (wanted < light[low]) return 0.0;
    if (!(wanted < light[high])) return (double)high;
    while (high - low > 1) {
        int64_t middle = (low + high) / 2;
        if (light[middle] <= wanted) low = middle;
        else high = middle;
    }
    if (light[low] == wanted) return (double)low;
    return 1.0 / (light[high] - light[low]) * (wanted - light[low]) + (double)low;
}

/* Difference of the stored levels that correspond to two lights: table of light, highest level, both lights. */
LOOP(coded_picture_stored_difference, "Fidd", "d") {
    out[0].d = fabs(stored_level(FLOATS(0), in[1].i + 1, in[3].d) - stored_level(FLOATS(0), in[1].i + 1, in[2].d));
}
