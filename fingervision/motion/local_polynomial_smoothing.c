/* A polynomial fitted to a window. */
typedef struct {
    double value, leverage; /* at the sample: the leverage is its variance over that of one sample */
    double top;             /* coefficient of its highest power; 0 where that is not significant */
    double missed;          /* what a unit of the next higher power would add at the sample, and the polynomial not show */
    int passes;             /* whether the rest is noise */
} Window;

/* Fit by orthogonal polynomials (Forsythe 1957); `work` has room for three windows. */
static Window polynomial(const double *time, const double *values, int64_t at, int64_t low, int64_t high, int degree,
                         double sigma, int rounded, double *work) {
    Window found = {0.0, 0.0, 0.0, 0.0, 0};
    int64_t count = high - low;
    double middle_time = 0.5 * (time[low] + time[high - 1]), norm_before = 1.0, *rest = work, *before = work + count, *now = before + count;
    for (int64_t j = 0; j < count; j++) {
        rest[j] = values[low + j];
        before[j] = 0.0;
        now[j] = 1.0;
    }
    for (int power = 0; power < degree + 2; power++) {
        double norm = 0.0, along = 0.0, shift = 0.0;
        for (int64_t j = 0; j < count; j++) {
            norm += now[j] * now[j];
            along += rest[j] * now[j];
            shift += (time[low + j] - middle_time) * now[j] * now[j];
        }
        if (power > degree) {
            double chi = 0.0, ends = 0.0, freedom = (double)(count - degree - 1);
            for (int64_t j = 0; j < count; j++) chi += rest[j] * rest[j];
            for (int64_t j = 0; j < 3; j++) ends = larger(ends, larger(fabs(rest[j]), fabs(rest[count - 1 - j])));
            found.passes = chi / square(sigma) <= freedom + CHI_SIGMAS * sqrt(2.0 * freedom) && ends <= END_SIGMAS * sigma &&
                           fabs(along) <= TREND_SIGMAS * sigma * sqrt(norm);
            /* Where each sample is a whole number of steps on, all are rounded alike, and no mean shows it. */
            if (rounded) found.leverage += larger(0.0, 1.0 - chi / square(sigma) / freedom);
            found.missed = now[at - low];
            return found;
        }
        double coefficient = along / norm;
        found.value += coefficient * now[at - low];
        found.leverage += square(now[at - low]) / norm;
        found.top = fabs(coefficient) * sqrt(norm) > CURVED_SIGMAS * sigma ? coefficient : 0.0;
        shift /= norm;
        double ratio = power > 0 ? norm / norm_before : 0.0;
        for (int64_t j = 0; j < count; j++) {
            rest[j] -= coefficient * now[j];
            double ahead = (time[low + j] - middle_time - shift) * now[j] - ratio * before[j];
            before[j] = now[j];
            now[j] = ahead;
        }
        norm_before = norm;
    }
    return found;
}

/* Time, input, sigma, whether rounded, windows of lines and of parabolas, the widest first; smooth input and leverage. */
LOOP(local_polynomial_smoothing_run, "FFdiIIff", "") {
    const double *time = FLOATS(0), *input = FLOATS(1), sigma = in[2].d;
    double *smooth = FLOATS(6), *leverage = FLOATS(7);
    int64_t count = in[1].n, most = 1;
    for (int k = 4; k < 6; k++)
        for (int64_t j = 0; j < in[k].n; j++) most = larger_int(most, INTS(k)[j]);
    double *work = floats(3 * most);
    for (int64_t i = 0; i < count; i++) {
        smooth[i] = input[i];
        leverage[i] = 1.0;
        /* A line's last sample has nothing beyond it that vouches for the line: corners are rounded by less than shows. */
        int64_t least = smaller_int(1, smaller_int(i, count - 1 - i)), inside = 0;
        double curvature = 0.0, bent_value = 0.0, bent_leverage = 1.0;
        for (int degree = 2; degree > 0; degree--) {
            const int64_t *widths = INTS(degree == 2 ? 5 : 4), kinds = in[degree == 2 ? 5 : 4].n;
            for (int64_t w = 0; w < kinds; w++) {
                int64_t width = widths[w];
                if (1.0 / (double)width >= (degree == 2 ? bent_leverage : leverage[i])) break;
                for (int64_t place = 0; place < PLACES; place++) {
                    int64_t low = i - (place * (width - 1)) / (PLACES - 1), high = low + width;
                    int64_t depth = smaller_int(i - low, high - 1 - i);
                    if (low < 0 || high > count || depth < least) continue;
                    Window found = polynomial(time, input, i, low, high, degree, sigma, (int)in[3].i, work);
                    if (!found.passes) continue;
                    inside = larger_int(inside, depth);
                    if (degree == 2 && CHOSEN * found.leverage < bent_leverage) {
                        bent_value = found.value;
                        bent_leverage = CHOSEN * found.leverage;
                        curvature = found.top;
                    } else if (degree == 1) {
                        /* What the widest parabola bends away from this line counts as its error. */
                        double weight = found.leverage + square(curvature * found.missed / sigma);
                        if (weight < leverage[i]) {
                            smooth[i] = found.value;
                            leverage[i] = weight;
                        }
                    }
                }
            }
        }
        if (bent_leverage < leverage[i]) {
            smooth[i] = bent_value;
            leverage[i] = bent_leverage;
        }
        leverage[i] = larger(leverage[i], 1.0 / (1.0 + (double)inside));
    }
    free(work);
}
