/* Vertex of the parabola through three values about a maximum. */
static double vertex(double before, double middle, double after) {
    double bend = before - 2.0 * middle + after;
    return bend < 0.0 ? 0.5 * (before - after) / bend : 0.0;
}

/* Best match of a template. Arguments: part of the picture without its mean; its correlation with the template without its
   mean (circular, from the template's first pixel); columns, rows and norm of the template; width of the border that only
   serves to check where the peak ends. Returns column and row (interpolated by a parabola), zero-normalised correlation, and
   whether the match is unique. */
LOOP(template_search_best, "SSiidi", "dddb") {
    const float *part = (const float *)in[0].data, *product = (const float *)in[1].data;
    int64_t height = in[0].shape[0], width = in[0].shape[1], stride = in[1].shape[1], n = in[2].i, m = in[3].i;
    int64_t columns = width - n + 1, rows = height - m + 1, beyond = in[5].i, best_row = beyond, best_column = beyond;
    double pixels = (double)(n * m), norm = in[4].d;
    for (int k = 0; k < 3; k++) out[k].d = 0.0;
    out[3].i = 0;
    if (rows <= 2 * beyond || columns <= 2 * beyond) return;
    double *sums = floats(width), *squares = floats(width);
    float *seen = (float *)room(rows * columns, sizeof(float)), best = -2.0f;
    for (int64_t x = 0; x < width; x++) sums[x] = squares[x] = 0.0;
    for (int64_t y = 0; y < height; y++) {
        for (int64_t x = 0; x < width; x++) {
            double now = part[y * width + x], old = y >= m ? part[(y - m) * width + x] : 0.0;
            sums[x] += now - old;
            squares[x] += now * now - old * old;
        }
        if (y < m - 1) continue;
        int64_t row = y - m + 1;
        double sum = 0.0, square_sum = 0.0;
        for (int64_t x = 0; x < width; x++) {
            sum += sums[x];
            square_sum += squares[x];
            if (x < n - 1) continue;
            int64_t column = x - n + 1;
            double spread = square_sum - sum * sum / pixels, found = product[row * stride + column], limit;
            /* A contrast that does not exceed rounding errors counts as no contrast. */
            limit = spread <= smaller(0.5, 1e-6 * square_sum) ? 0.0 : sqrt(spread) * norm;
            seen[row * columns + column] = fabs(found) < limit ? (float)(found / limit)
                                           : fabs(found) < 1.125 * limit ? (found > 0.0 ? 1.0f : -1.0f) : 0.0f;
            sum -= sums[column];
            square_sum -= squares[column];
        }
    }
    for (int64_t y = beyond; y < rows - beyond; y++)
        for (int64_t x = beyond; x < columns - beyond; x++)
            if (seen[y * columns + x] > best) {
                best = seen[y * columns + x];
                best_row = y;
                best_column = x;
            }
    const float *at = seen + best_row * columns + best_column;
    out[0].d = (double)best_column + (beyond ? vertex(at[-1], at[0], at[1]) : 0.0);
    out[1].d = (double)best_row + (beyond ? vertex(at[-columns], at[0], at[columns]) : 0.0);
    out[2].d = best;
    if (best > 0.0f) {
        /* Connected area of the correlation peak at the best match, and other positions with a similar correlation. */
        float alike = (float)(ALIKE_SHARE * best);
        int64_t *waiting = ints(rows * columns), count = 1, is_alone = 1;
        waiting[0] = best_row * columns + best_column;
        seen[waiting[0]] = -2.0f;
        while (count) {
            int64_t place = waiting[--count], y = place / columns, x = place % columns;
            if (y == 0 || x == 0 || y == rows - 1 || x == columns - 1) {
                is_alone = 0;
                break;
            }
            const int64_t next[4] = {place - 1, place + 1, place - columns, place + columns};
            for (int k = 0; k < 4; k++)
                if (seen[next[k]] >= alike) {
                    seen[next[k]] = -2.0f;
                    waiting[count++] = next[k];
                }
        }
        for (int64_t y = beyond; y < rows - beyond && is_alone; y++)
            for (int64_t x = beyond; x < columns - beyond && is_alone; x++) is_alone = seen[y * columns + x] < alike;
        out[3].i = is_alone;
        free(waiting);
    }
    free(sums);
    free(squares);
    free(seen);
}
