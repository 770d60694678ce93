/* after finger_shape */
/* after linear_solve */
/* Corner of two sides of a chain, each given by a point and the angle of its direction, with a fillet of a radius. */
static Corner chain_corner(const double *one, const double *two, double radius) {
    Corner c;
    c.flank_x = sin(one[2]);
    c.flank_y = -cos(one[2]);
    c.top_x = sin(two[2]);
    c.top_y = -cos(two[2]);
    c.flank_k = c.flank_x * one[0] + c.flank_y * one[1];
    c.top_k = c.top_x * two[0] + c.top_y * two[1];
    c.determinant = c.flank_x * c.top_y - c.flank_y * c.top_x;
    c.centre_x = ((c.flank_k - radius) * c.top_y - (c.top_k - radius) * c.flank_y) / c.determinant;
    c.centre_y = (c.flank_x * (c.top_k - radius) - c.top_x * (c.flank_k - radius)) / c.determinant;
    c.radius = radius;
    return c;
}

/* Distance of a point along the normal from the contour of a chain, its derivatives by displacements of the two sides of its
   corner, and the factor by which they are divided: the uncertainty along the normal. */
typedef struct {
    double distance, to_one, to_two, normal_u;
    int is_on_fillet;
} Away;

/* The same from the half-level contour of a blurred corner that is sharp or nearly sharp, and how much of the blur's effect is
   felt there. Depths are measured from the vertex along the bisector. */
static Away from_sharp_corner(const Corner *c, double x, double y, double blur, double retreat, double *felt) {
    double turn = atan2(c->determinant, c->flank_x * c->top_x + c->flank_y * c->top_y), half = 0.5 * turn;
    double cosine = cos(half), tangent = tan(half), to_vertex = c->radius / cosine;
    double inward_x = -(c->flank_x + c->top_x) / (2.0 * cosine), inward_y = -(c->flank_y + c->top_y) / (2.0 * cosine);
    double dx = x - (c->centre_x - to_vertex * inward_x), dy = y - (c->centre_y - to_vertex * inward_y);
    double depth = dx * inward_x + dy * inward_y, towards_two = dx * inward_y - dy * inward_x;
    double beside = fabs(towards_two), own = beside * tangent, steep = tangent;
    if (beside < c->radius * sin(half)) {
        double on_arc = sqrt(larger(square(c->radius) - square(beside), 1e-12));
        own = to_vertex - on_arc;
        steep = beside / on_arc;
    }
    double along = beside / (blur * cosine);
    *felt = exp(-FALL * along * along);
    double blurred = square(retreat * blur) * *felt, contour = sqrt(square(own) + blurred);
    double slope = (own * steep - blurred * FALL * along / (blur * cosine)) / larger(contour, 1e-9);
    double tilt = within(towards_two < 0.0 ? -atan(slope) : atan(slope), -half, half), sine = sin(turn);
    return (Away){(contour - depth) / sqrt(1.0 + square(slope)), sin(half - tilt) / sine, sin(half + tilt) / sine, 0.0, 0};
}

static Away from_corner(const Corner *c, double x, double y, double u, int is_row, double blur, double retreat) {
    double felt = 0.0, share = within((c->radius / blur - SHARP_BELOW) / (ROUND_ABOVE - SHARP_BELOW), 0.0, 1.0);
    Spot at = spot(c, x, y);
    Away found = {at.distance, at.to_flank, at.to_top, 0.0, at.is_on_fillet};
    if (share > 0.0) found.distance += half_level(c, &at, x - c->centre_x, y - c->centre_y, blur);
    if (share < 1.0) {
        Away sharp = from_sharp_corner(c, x, y, blur, retreat, &felt);
        found.distance = share * found.distance + (1.0 - share) * sharp.distance;
        found.to_one = share * found.to_one + (1.0 - share) * sharp.to_one;
        found.to_two = share * found.to_two + (1.0 - share) * sharp.to_two;
    }
    found.normal_u = hypot(u * slant(c, &at, is_row), U_CONTOUR_IN_BLURS * blur * felt * (1.0 - share));
    return found;
}

/* Corner to which a point belongs: near a convex outline, the nearest side is the one of which a point lies farthest outside,
   and the nearest corner is at that end of the side which is on the point's side of its middle. */
static int64_t corner_of(const double *sides, const Corner *sharp, int64_t count, double x, double y) {
    int64_t k = 0;
    double outside = -INFINITY;
    for (int64_t s = 0; s < count; s++) {
        const Corner *c = &sharp[s < count - 1 ? s : s - 1];
        double away = s < count - 1 ? c->flank_x * x + c->flank_y * y - c->flank_k : c->top_x * x + c->top_y * y - c->top_k;
        if (away > outside) k = s;
        outside = larger(outside, away);
    }
    if (k == 0 || k == count - 1) return k ? k - 1 : 0;
    double middle_x = 0.5 * (sharp[k - 1].centre_x + sharp[k].centre_x);
    double middle_y = 0.5 * (sharp[k - 1].centre_y + sharp[k].centre_y);
    return (x - middle_x) * cos(sides[3 * k + 2]) + (y - middle_y) * sin(sides[3 * k + 2]) > 0.0 ? k : k - 1;
}

/* Distance of a blurred sharp corner's half-level from its vertex, in units of the blur, from values at turns of equal
   spacing; -1 outside them. */
static double retreat_of(double turn, const Arg *turns, const Arg *values) {
    const double *known = (const double *)turns->data, *value = (const double *)values->data;
    double low = known[0], high = known[turns->n - 1];
    if (!(turn > low && turn < high)) return -1.0;
    double at = (turn - low) / (high - low) * (double)(turns->n - 1);
    int64_t k = smaller_int((int64_t)at, turns->n - 2);
    return value[k] + (at - (double)k) * (value[k + 1] - value[k]);
}

/* Distances of the points of a half-level outline from the contour of a blurred chain, in units of their uncertainties, and
   their derivatives by a displacement of every side, by a rotation of every side, and by every radius. The arguments are
   those of chain_fit. Returns 0 if the sides are not convex. */
static int from_chain(const Arg *in) {
    int64_t count = in[0].n / 3, unknowns = 3 * count - 1;
    const double *sides = FLOATS(0), *radii = FLOATS(1), *blur = FLOATS(7);
    double retreats[MOST_SIDES];
    Corner corners[MOST_SIDES], wider[MOST_SIDES], sharp[MOST_SIDES];
    for (int64_t k = 0; k + 1 < count; k++) {
        const double *one = sides + 3 * k, *two = one + 3;
        retreats[k] = retreat_of(remainder(two[2] - one[2], 2.0 * PI), &in[15], &in[10]);
        if (retreats[k] < 0.0) return 0;
        corners[k] = chain_corner(one, two, radii[k]);
        wider[k] = chain_corner(one, two, radii[k] + STEP_PX);
        sharp[k] = chain_corner(one, two, 0.0);
    }
    memset(FLOATS(13), 0, (size_t)in[13].n * sizeof(double));
    for (int64_t i = 0; i < in[3].n; i++) {
        double x = FLOATS(3)[i], y = FLOATS(4)[i], u = FLOATS(5)[i], *by = FLOATS(13) + i * unknowns;
        int64_t k = corner_of(sides, sharp, count, x, y);
        const Corner *c = &corners[k];
        Away at = from_corner(c, x, y, u, FLAGS(6)[i], blur[i], retreats[k]);
        FLOATS(12)[i] = at.distance / at.normal_u;
        if (!in[13].n) continue;
        double wide = from_corner(&wider[k], x, y, u, FLAGS(6)[i], blur[i], retreats[k]).distance;
        by[2 * count + k] = (wide - at.distance) / (STEP_PX * at.normal_u);
        for (int two = 0; two < 2; two++) {
            const double *side = sides + 3 * (k + two);
            double share = (two ? at.to_two : at.to_one) / at.normal_u, dx = x - side[0], dy = y - side[1];
            if (at.is_on_fillet) {
                /* A rotation of a side moves the centre of its fillet, which lies one radius inside the side. */
                dx = c->centre_x + c->radius * (two ? c->top_x : c->flank_x) - side[0];
                dy = c->centre_y + c->radius * (two ? c->top_y : c->flank_y) - side[1];
            }
            by[k + two] = -share;
            by[count + k + two] = share * (dx * cos(side[2]) + dy * sin(side[2]));
        }
    }
    return 1;
}

/* Weighted squares and products of the derivatives, and of derivatives and distances, with the priors of all unknowns. */
static void weighed_chain(const Arg *in, double patience, const double *away, const double *prior, double *information,
                          double *gradient) {
    int64_t unknowns = in[14].n;
    double variance = in[9].d;
    memset(information, 0, (size_t)(unknowns * unknowns) * sizeof(double));
    for (int64_t a = 0; a < unknowns; a++) {
        information[a * unknowns + a] = prior[a];
        gradient[a] = prior[a] * away[a];
    }
    for (int64_t i = 0; i < in[3].n; i++) {
        const double *by = FLOATS(13) + i * unknowns;
        double residual = FLOATS(12)[i], squares = square(residual / patience) / variance;
        double weight = 1.0 / (variance * (1.0 + exp(smaller(0.5 * (squares - DUST), 50.0))));
        for (int64_t a = 0; a < unknowns; a++) {
            if (by[a] == 0.0) continue;
            gradient[a] += weight * by[a] * residual;
            for (int64_t b = 0; b <= a; b++) information[a * unknowns + b] += weight * by[a] * by[b];
        }
    }
    for (int64_t a = 0; a < unknowns; a++)
        for (int64_t b = 0; b < a; b++) information[b * unknowns + a] = information[a * unknowns + b];
}

/* Fit of a chain by Gauss-Newton steps. Arguments: sides (n, 3) and radii (n - 1), which are replaced; standard deviations of
   the priors (m); x, y, u, is_row, blur; patience of every step; factor on the variances; retreats of blurred sharp
   corners; results, information (m, m) with m = 3 n - 1, residuals, derivatives (points, m; or
   none, and no information, where only the residuals are wanted),
   and how far every unknown is from its prior's mean (m); turns of
   the blurred corners. Returns whether the sides are convex. */
LOOP(chain_fit, "ffFFFFBFFdFffffF", "b") {
    int64_t count = in[0].n / 3, unknowns = 3 * count - 1;
    double *sides = FLOATS(0), *radii = FLOATS(1), *away = FLOATS(14), *information = FLOATS(11);
    double prior[3 * MOST_SIDES], gradient[3 * MOST_SIDES], matrix[9 * MOST_SIDES * MOST_SIDES];
    for (int64_t a = 0; a < unknowns; a++) {
        prior[a] = 1.0 / square(FLOATS(2)[a]);
        away[a] = a < 2 * count ? 0.0 : radii[a - 2 * count];
    }
    out[0].i = from_chain(in);
    for (int64_t look = 0; look < in[8].n && out[0].i; look++) {
        double patience = FLOATS(8)[look], most = MOST_TURNED, length = 0.0;
        weighed_chain(in, patience, away, prior, information, gradient);
        memcpy(matrix, information, (size_t)(unknowns * unknowns) * sizeof(double));
        double step[3 * MOST_SIDES];
        memcpy(step, gradient, sizeof step);
        if (!solve(matrix, (int)unknowns, step, 1)) {
            out[0].i = 0;
            return;
        }
        for (int64_t k = 0; k < count; k++) most = larger(most, fabs(step[count + k]));
        for (int64_t a = 0; a < unknowns; a++) {
            length += step[a] * gradient[a];
            step[a] *= -MOST_TURNED / most;
            away[a] += step[a];
        }
        for (int64_t k = 0; k < count; k++) {
            double *side = sides + 3 * k;
            side[0] += step[k] * sin(side[2]);
            side[1] -= step[k] * cos(side[2]);
            side[2] += step[count + k];
        }
        for (int64_t k = 0; k + 1 < count; k++) radii[k] = away[2 * count + k] = larger(away[2 * count + k], 0.0);
        out[0].i = from_chain(in);
        if (patience == 1.0 && length < SETTLED) break;
    }
    if (in[13].n) weighed_chain(in, 1.0, away, prior, information, gradient);
}
