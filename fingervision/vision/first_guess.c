/* after profile_lines */
/* after finger_shape */
/* after median */
/* Least-squares line v = c + m t; slope 0 if all t are equal. */
static void line(const double *t, const double *v, int64_t n, double *c, double *m) {
    double mean_t = 0.0, mean_v = 0.0, spread = 0.0, shared = 0.0;
    *c = *m = 0.0;
    if (n == 0) return;
    for (int64_t i = 0; i < n; i++) {
        mean_t += t[i];
        mean_v += v[i];
    }
    mean_t /= (double)n;
    mean_v /= (double)n;
    for (int64_t i = 0; i < n; i++) {
        spread += square(t[i] - mean_t);
        shared += (t[i] - mean_t) * v[i];
    }
    *m = spread > 1.0 ? shared / spread : 0.0;
    *c = mean_v - *m * mean_t;
}

static void ends_of(const double *values, int64_t n, double *least, double *most) {
    *least = *most = n > 0 ? values[0] : 0.0;
    for (int64_t i = 1; i < n; i++) {
        *least = smaller(*least, values[i]);
        *most = larger(*most, values[i]);
    }
}

/* Middle of the tip, and a line through its middle part; through all points if few belong to the tip. */
static double top_line(const double *x, const double *y, const int64_t *side, int64_t n, double *c, double *m) {
    double *px = floats(n), *py = floats(n), least, most;
    int64_t count = 0, tips = 0;
    for (int64_t i = 0; i < n; i++) tips += side[i] == TIP_SIDE;
    for (int64_t i = 0; i < n; i++)
        if (tips < FEWEST_POINTS || side[i] == TIP_SIDE) {
            px[count] = x[i];
            py[count++] = y[i];
        }
    ends_of(px, count, &least, &most);
    double x0 = 0.5 * (least + most), half_width = 0.5 * (most - least);
    int64_t kept = 0;
    for (int64_t i = 0; i < count; i++)
        if (fabs(px[i] - x0) <= 0.6 * half_width + 1.0) {
            px[kept] = px[i] - x0;
            py[kept++] = py[i];
        }
    line(px, py, kept, c, m);
    free(px);
    free(py);
    return x0;
}

/* Line through the half of a flank that is farther from the tip, robust against dust; returns whether there is a line. The
   slope is the median of the slopes between points of one quarter of the flank and of the next (Theil and Sen, with fewer
   pairs). */
static int lower_flank(const double *x, const double *y, const int64_t *side, int64_t n, int64_t wanted, double *c, double *m) {
    double *px = floats(n), *py = floats(n), *slopes = floats(n), least, most;
    int64_t count = 0, low = 0;
    *c = *m = 0.0;
    for (int64_t i = 0; i < n; i++)
        if (side[i] == wanted) {
            px[count] = x[i];
            py[count++] = y[i];
        }
    if (count >= FEWEST_POINTS) {
        ends_of(py, count, &least, &most);
        for (int64_t i = 0; i < count; i++)
            if (py[i] >= 0.5 * (least + most)) {
                px[low] = px[i];
                py[low++] = py[i];
            }
        int64_t half = low / 2;
        if (half == 0) {
            *c = px[0];
        } else {
            for (int64_t i = 0; i < half; i++) slopes[i] = (px[low - half + i] - px[i]) / (py[low - half + i] - py[i]);
            *m = middle_in_place(slopes, half);
            for (int64_t i = 0; i < low; i++) slopes[i] = px[i] - *m * py[i];
            *c = middle_in_place(slopes, low);
        }
    }
    free(px);
    free(py);
    free(slopes);
    return count >= FEWEST_POINTS;
}

/* Fillet radius from the points inside both sides of a corner, towards `sense` from x0. A fillet of radius r in a right
   angle passes through every point whose distances a and b from the two sides satisfy (r - a)^2 + (r - b)^2 = r^2; the
   median over the points is robust against dust. Blur moves the half-level inwards on the bisector: by sigma^2 / 2r on a
   large fillet, by 0.77 sigma at a sharp corner (where the product of two error functions is one half); between these limits
   a smooth transition is used. */
static double fillet_radius(const double *x, const double *below_top, int64_t n, double sense, double x0, double below_tip,
                            double flank_c, double flank_m, double top_c, double top_m, double blur) {
    double *through = floats(n), least = 0.0;
    int64_t count = 0, near = 0;
    for (int64_t i = 0; i < n; i++) {
        double along = sense * (x[i] - x0), y = below_top[i] - below_tip;
        double a = sense * (flank_c - x0) + sense * flank_m * y - along, b = (below_top[i] - top_c) - sense * top_m * along;
        if (along > 0.0 && smaller(a, b) > INSIDE_CORNER_PX) {
            through[count] = a + b + sqrt(2.0 * a * b);
            least = count ? smaller(least, through[count]) : through[count];
            count++;
        }
    }
    /* Points beyond the end of the fillet belong to the other corner. */
    for (int64_t i = 0; i < count; i++)
        if (through[i] < 3.0 * least + 3.0) through[near++] = through[i];
    double radius = middle_in_place(through, near), retreat = radius * CORNER_RETREAT;
    free(through);
    if (count == 0) return 0.0;
    for (int step = 0; step < 10; step++) {
        double shift = blur / sqrt(square(2.0 * radius / blur) + 1.0 / square(SHARP_CORNER));
        radius = 0.5 * (radius + larger(retreat - shift, 0.0) / CORNER_RETREAT);
    }
    return radius;
}

/* Starting values for the fit of a finger's end. Arguments: x, height below the top, side, blur, measuring height; results,
   start, origin and prior. */
LOOP(first_guess_guess, "FFIddfff", "") {
    const double *x = FLOATS(0), *below_top = FLOATS(1), blur = in[3].d, below_tip = in[4].d;
    const int64_t *side = INTS(2), n = in[0].n;
    double *start = FLOATS(5), *origin = FLOATS(6), *u_prior = FLOATS(7), least, most;
    double top_c, top_m, inner_c, inner_m, outer_c, outer_m, *y = floats(n);
    for (int a = 0; a < PARAMETERS; a++) {
        start[a] = 0.0;
        u_prior[a] = 1e3;
    }
    u_prior[INNER_M] = u_prior[TOP_M] = u_prior[OUTER_M] = SLOPE_PRIOR;
    for (int64_t i = 0; i < n; i++) y[i] = below_top[i] - below_tip;
    double x0 = top_line(x, below_top, side, n, &top_c, &top_m);
    int is_inner_seen = lower_flank(x, y, side, n, INNER_SIDE, &inner_c, &inner_m);
    int is_outer_seen = lower_flank(x, y, side, n, OUTER_SIDE, &outer_c, &outer_m);
    ends_of(x, n, &least, &most);
    if (!is_inner_seen) inner_c = most;
    if (!is_outer_seen) { /* the border cuts the finger, so that the far corner is not visible */
        outer_c = least - BEYOND_BORDER_PX;
        u_prior[OUTER_C] = 1.0;
        u_prior[OUTER_M] = 0.05;
        u_prior[OUTER_R] = 1.0;
        /* If only the inner fillet is in view, the slope of the top is unknown: the top is assumed to be perpendicular to
           the flank. */
        top_m = -inner_m;
        u_prior[TOP_M] = SQUARE_PRIOR;
    } else if (fabs(inner_m - outer_m) > MOST_TAPER) {
        /* The inner flank below the round corner is not in view: it is assumed to be parallel to the outer flank. */
        inner_c = most + 1.0;
        inner_m = outer_m;
        u_prior[INNER_M] = TAPER_PRIOR;
    }
    start[INNER_C] = inner_c;
    start[INNER_M] = inner_m;
    start[TOP_C] = top_c;
    start[TOP_M] = top_m;
    start[OUTER_C] = outer_c;
    start[OUTER_M] = outer_m;
    double largest = 0.49 * larger(inner_c - outer_c, 2.0);
    for (int k = 0; k < 2; k++) {
        int parameter = k ? OUTER_R : INNER_R;
        double radius = fillet_radius(x, below_top, n, k ? -1.0 : 1.0, x0, below_tip, k ? outer_c : inner_c,
                                      k ? outer_m : inner_m, top_c, top_m, blur);
        start[parameter] = smaller(radius, largest);
        if (radius < SHARP_IN_BLURS * blur && u_prior[parameter] > 1.0) u_prior[parameter] = SHARP_PRIOR_IN_BLURS * blur;
    }
    origin[0] = x0;
    origin[1] = below_tip;
    free(y);
}

/* Line through points; its offset and slope. */
LOOP(first_guess_line, "FF", "dd") { line(FLOATS(0), FLOATS(1), in[0].n, &out[0].d, &out[1].d); }
