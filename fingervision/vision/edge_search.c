/* after median */
/* Mean level of every strip of a zone. Arguments: picture; light of every level (none: the level itself); rows and columns
   of the zone's pixels relative to its centre; for each pixel the preceding strip, and the share of the next strip; number
   of pixels of each strip; column and row of the centre; whether the whole zone lies in the picture; results, mean level and
   number of pixels in the picture. Returns the median variance within the strips. */
LOOP(edge_search_profile, "pFIIIFFiiiff", "d") {
    const int64_t *rows = INTS(2), *columns = INTS(3), *strip = INTS(4);
    const double *light = FLOATS(1), *share = FLOATS(5);
    int64_t pixels = in[4].n, size = in[6].n, middle_x = in[7].i, middle_y = in[8].i, full = 0, has_light = in[1].n > 0;
    double *mean = FLOATS(10), *count = FLOATS(11), *squares = floats(size);
    for (int64_t j = 0; j < size; j++) mean[j] = squares[j] = 0.0;
    if (in[9].i) memcpy(count, FLOATS(6), (size_t)size * sizeof(double));
    else memset(count, 0, (size_t)size * sizeof(double));
    for (int64_t i = 0; i < pixels; i++) {
        int64_t row = rows[i] + middle_y, column = columns[i] + middle_x;
        if (!in[9].i) {
            if (row < 0 || column < 0 || row >= in[0].shape[0] || column >= in[0].shape[1]) continue;
            count[strip[i]] += 1.0 - share[i];
            count[strip[i] + 1] += share[i];
        }
        int64_t stored = pixel(in, row, column);
        double level = has_light ? light[stored] : (double)stored, upper = share[i] * level, square_upper = upper * level;
        mean[strip[i]] += level - upper;
        mean[strip[i] + 1] += upper;
        squares[strip[i]] += level * level - square_upper;
        squares[strip[i] + 1] += square_upper;
    }
    for (int64_t j = 0; j < size; j++) {
        double total = mean[j];
        mean[j] = total / larger(count[j], 1.0);
        /* The levels scatter more in strips that contain a slanted edge; the median strip has the usual scatter. */
        if (count[j] > 1.0) squares[full++] = larger(squares[j] - total * mean[j], 0.0) / (count[j] - 1.0);
    }
    out[0].d = middle_in_place(squares, full);
    free(squares);
}

/* Lobes of a derivative of one sign. Arguments: smoothed and original derivative, multiplied by the sign; results, positions
   from the first strip, and rises. Returns the number of lobes. */
static int64_t lobes(const double *smooth, const double *slope, int64_t n, double sign, double floor, double *place, double *rise) {
    int64_t *peaks = ints(n), count = 0, found = 0;
    for (int64_t i = 1; i < n - 1; i++) {
        double own = sign * smooth[i];
        if (!(own >= sign * smooth[i - 1] && own > sign * smooth[i + 1] && own > floor)) continue;
        if (count) {
            double last = sign * smooth[peaks[count - 1]], least = last;
            for (int64_t k = peaks[count - 1]; k < i; k++) least = smaller(least, sign * smooth[k]);
            if (least > VALLEY_SHARE * smaller(last, own)) {
                if (own > last) peaks[count - 1] = i;
                continue;
            }
        }
        peaks[count++] = i;
    }
    for (int64_t number = 0; number < count; number++) {
        int64_t first = peaks[number], last = first, low = number ? peaks[number - 1] : 0;
        int64_t high = number + 1 < count ? peaks[number + 1] : n - 1;
        double own = sign * smooth[first], limit = LOBE_SHARE * own, size = 0.0, moment = 0.0, total = 0.0;
        while (first > low && sign * smooth[first - 1] > limit && !(number && sign * smooth[first - 1] > sign * smooth[first]))
            first--;
        while (last < high && sign * smooth[last + 1] > limit &&
               !(number + 1 < count && sign * smooth[last + 1] > sign * smooth[last]))
            last++;
        for (int64_t k = first; k <= last; k++) {
            size += sign * slope[k];
            moment += (double)k * sign * smooth[k];
            total += sign * smooth[k];
        }
        if (size <= 0.0 || own < LEAST_STEEPNESS * size) continue;
        place[found] = moment / total + 0.5;
        rise[found++] = sign * size;
    }
    free(peaks);
    return found;
}

/* Steps of a profile. Arguments: levels, visible shares of the strips, least derivative; results, positions from the first
   strip, and contrasts. Returns the number of rising steps, and the number of all steps. */
LOOP(edge_search_steps, "FFdff", "ii") {
    const double *level = FLOATS(0), *weight = FLOATS(1);
    int64_t n = in[0].n - 1;
    double *slope = floats(n), *smooth = floats(n);
    for (int64_t i = 0; i < n; i++) slope[i] = weight[i] > 0.5 && weight[i + 1] > 0.5 ? level[i + 1] - level[i] : 0.0;
    smooth[0] = smooth[n - 1] = 0.0;
    for (int64_t i = 1; i < n - 1; i++) smooth[i] = 0.25 * slope[i - 1] + 0.5 * slope[i] + 0.25 * slope[i + 1];
    out[0].i = lobes(smooth, slope, n, 1.0, in[2].d, FLOATS(3), FLOATS(4));
    out[1].i = out[0].i + lobes(smooth, slope, n, -1.0, in[2].d, FLOATS(3) + out[0].i, FLOATS(4) + out[0].i);
    free(slope);
    free(smooth);
}
