/* after finger_shape */
/* Finger end with its top made perpendicular to its flanks unless the points contradict this: parameters and covariance,
   before and after. */
LOOP(measuring_point_squared, "FFdff", "") {
    enum { m = PARAMETERS };
    const double *p = FLOATS(0), *covariance = FLOATS(1), misfit = in[2].d;
    double toward[m];
    memcpy(FLOATS(3), p, m * sizeof(double));
    memcpy(FLOATS(4), covariance, m * m * sizeof(double));
    /* The slope of the top plus the mean slope of the flanks is zero if they are perpendicular. */
    double off_square = p[TOP_M] + 0.5 * (p[INNER_M] + p[OUTER_M]);
    for (int a = 0; a < m; a++)
        toward[a] = covariance[a * m + TOP_M] + 0.5 * (covariance[a * m + INNER_M] + covariance[a * m + OUTER_M]);
    double variance = (toward[TOP_M] + 0.5 * (toward[INNER_M] + toward[OUTER_M])) * square(misfit);
    if (square(off_square) >= square(SQUARE_IN_SIGMAS) * variance) return;
    for (int a = 0; a < m; a++) {
        double gain = toward[a] * (square(misfit) / (variance + square(U_SQUARE)));
        FLOATS(3)[a] -= gain * off_square;
        for (int b = 0; b < m; b++) FLOATS(4)[a * m + b] -= gain * toward[b];
    }
}

static double product(const double *a, const double *matrix, const double *b) {
    double total = 0.0;
    for (int i = 0; i < PARAMETERS; i++)
        for (int j = 0; j < PARAMETERS; j++) total += a[i] * matrix[i * PARAMETERS + j] * b[j];
    return total;
}

/* Heights of the outermost points (along the axis) of the inner and of the outer fillet. */
static void tops_of(const double *p, const double *origin, double *inner, double *outer) {
    Corner first = corner(p, origin, 0), second = corner(p, origin, 1);
    *inner = first.centre_y - first.radius;
    *outer = second.centre_y - second.radius;
}

/* Height of the tip, the edge at the measuring height, and its slope, with one parameter moved. */
static void tip_and_edge(const double *p, const double *origin, double inner_share, double below_tip, int parameter,
                         double by, double *tip, double *edge, double *slope) {
    double moved[PARAMETERS], inner, outer;
    memcpy(moved, p, sizeof moved);
    moved[parameter] += by;
    tops_of(moved, origin, &inner, &outer);
    *tip = inner_share * inner + (1.0 - inner_share) * outer;
    inner_edge(moved, origin, *tip + below_tip, edge, slope);
}

/* Measuring point of a finger end. Arguments: parameters, covariance, misfit, origin, measuring height, blur; results,
   covariance of tip and edge; tip, apex, edge, slope. The covariance is increased because blur hides the radius of small
   corners, equally in both fingers. */
LOOP(measuring_point_read_off, "FFdFddf", "dddd") {
    enum { m = PARAMETERS };
    const double *p = FLOATS(0), *covariance = FLOATS(1), misfit = in[2].d, *origin = FLOATS(3), below_tip = in[4].d;
    double wider[m * m], by_lean[m], by_tip[m], by_edge[m], moved[m], *found = FLOATS(6);
    memcpy(wider, covariance, sizeof wider);
    for (int k = 0; k < 2; k++) {
        int a = k ? OUTER_R : INNER_R;
        if (wider[a * m + a] > square(UNSEEN_PX)) {
            for (int b = 0; b < m; b++) wider[a * m + b] = wider[b * m + a] = 0.0;
            wider[a * m + a] = square(p[a] + UNSEEN_IN_BLURS * in[5].d);
        }
        double hidden = larger(1.0 - p[a] / (HIDDEN_IN_BLURS * in[5].d), 0.0);
        wider[a * m + a] += 2.0 * square(U_CORNER_IN_BLURS * in[5].d * hidden);
    }
    Corner inner = corner(p, origin, 0), outer = corner(p, origin, 1);
    double lean = (outer.centre_y - outer.radius) - (inner.centre_y - inner.radius);
    for (int a = 0; a < m; a++) {
        double up_inner, up_outer, down_inner, down_outer;
        memcpy(moved, p, sizeof moved);
        moved[a] += STEP;
        tops_of(moved, origin, &up_inner, &up_outer);
        memcpy(moved, p, sizeof moved);
        moved[a] += -STEP;
        tops_of(moved, origin, &down_inner, &down_outer);
        by_lean[a] = (up_outer - up_inner - down_outer + down_inner) / (2.0 * STEP);
    }
    double u_lean = sqrt(larger(product(by_lean, covariance, by_lean), 0.0)) * misfit;
    int is_level = fabs(lean) < smaller(LEVEL_IN_SIGMAS * u_lean, LEVEL_LIMIT_PX);
    double inner_share = is_level ? 0.5 : lean > 0.0 ? 1.0 : 0.0;
    tip_and_edge(p, origin, inner_share, below_tip, 0, 0.0, &out[0].d, &out[2].d, &out[3].d);
    for (int a = 0; a < m; a++) {
        /* A radius cannot be negative, but may be so much larger that the measuring point lies on the fillet. */
        int is_radius = a == INNER_R || a == OUTER_R;
        double more = is_radius ? smaller(sqrt(wider[a * m + a]), LARGEST_STEP_PX) : STEP, less = is_radius ? 0.0 : STEP;
        double up_tip, up_edge, down_tip, down_edge, slope;
        tip_and_edge(p, origin, inner_share, below_tip, a, more, &up_tip, &up_edge, &slope);
        tip_and_edge(p, origin, inner_share, below_tip, a, -less, &down_tip, &down_edge, &slope);
        by_tip[a] = (up_tip - down_tip) / (more + less);
        by_edge[a] = (up_edge - down_edge) / (more + less);
    }
    found[0] = product(by_tip, wider, by_tip);
    found[1] = found[2] = product(by_tip, wider, by_edge);
    found[3] = product(by_edge, wider, by_edge);
    out[1].d = inner_share == 0.0 ? outer.centre_x : inner.centre_x;
}
