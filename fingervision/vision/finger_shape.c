/* One flank, the top, and the fillet between them: outward unit normals n, offsets n . q, centre and radius. */
typedef struct {
    double flank_x, flank_y, flank_k, top_x, top_y, top_k, centre_x, centre_y, radius, determinant;
} Corner;

static Corner corner(const double *p, const double *origin, int is_outer) {
    Corner c;
    double slope = p[INNER_M + is_outer], radius = p[INNER_R + is_outer];
    c.flank_x = (1.0 - 2.0 * is_outer) / sqrt(1.0 + slope * slope);
    c.flank_y = -slope * c.flank_x;
    c.top_y = -1.0 / sqrt(1.0 + p[TOP_M] * p[TOP_M]);
    c.top_x = -p[TOP_M] * c.top_y;
    c.flank_k = c.flank_x * p[INNER_C + is_outer] + c.flank_y * origin[1];
    c.top_k = c.top_x * origin[0] + c.top_y * p[TOP_C];
    c.determinant = c.flank_x * c.top_y - c.flank_y * c.top_x;
    c.centre_x = ((c.flank_k - radius) * c.top_y - (c.top_k - radius) * c.flank_y) / c.determinant;
    c.centre_y = (c.flank_x * (c.top_k - radius) - c.top_x * (c.flank_k - radius)) / c.determinant;
    c.radius = radius;
    return c;
}

/* Position of a point relative to a corner: alpha and beta are its coordinates, from the centre of the fillet, in the basis
   of the normals of flank and top; to_flank and to_top are the derivatives of the point's distance by a displacement of
   flank and top. */
typedef struct {
    double distance, alpha, beta, to_flank, to_top;
    int is_on_fillet;
} Spot;

/* Signed normal distance of a point from the outline, and the side to which the point belongs. */
static Spot spot(const Corner *c, double x, double y) {
    double ux = x - c->centre_x, uy = y - c->centre_y;
    double alpha = (ux * c->top_y - uy * c->top_x) / c->determinant;
    double beta = (c->flank_x * uy - c->flank_y * ux) / c->determinant;
    if (alpha > 0.0 && beta > 0.0) {
        double length = larger(sqrt(ux * ux + uy * uy), 1e-6);
        return (Spot){length - c->radius, alpha, beta, alpha / length, beta / length, 1};
    }
    if (beta <= 0.0 && alpha > beta) return (Spot){c->flank_x * x + c->flank_y * y - c->flank_k, alpha, beta, 1.0, 0.0, 0};
    return (Spot){c->top_x * x + c->top_y * y - c->top_k, alpha, beta, 0.0, 1.0, 0};
}

/* Distance of the half-level inside the outline at a point (ux, uy) from the fillet's centre. The shift is sigma^2 kappa / 2
   on a fillet and decreases to zero beyond the fillet's ends: the mean of the heat kernels from 0 to sigma^2 / 2 acts like a
   single kernel of variance sigma^2 / 2. */
static double half_level(const Corner *c, const Spot *at, double ux, double uy, double blur) {
    double share = 1.0;
    for (int side = 0; side < 2; side++) {
        double nx = side ? c->top_x : c->flank_x, ny = side ? c->top_y : c->flank_y;
        double past_end = side ? at->alpha : at->beta, along = fabs(ux * ny - uy * nx);
        /* Far inside a fillet, the full curvature acts; an angle is never smaller than its sine. */
        double sine = past_end > 0.0 && ux * nx + uy * ny > 0.0 ? along / sqrt(ux * ux + uy * uy) : 0.0;
        if (c->radius * sine > WHOLLY_FELT_SIGMAS * blur) continue;
        double inside = (past_end > 0.0 ? c->radius * atan2(along, ux * nx + uy * ny) : -along) / (blur * sqrt(0.5));
        if (inside < -FELT_SIGMAS) return 0.0;
        share *= 0.5 * erfc(-inside * sqrt(0.5));
    }
    return 0.5 * blur * blur / larger(c->radius, blur) * share;
}

/* Cosine between a line of pixels and the outline's normal at their intersection. A displacement of a point along the line,
   times this cosine, is its displacement along the normal. */
static double slant(const Corner *c, const Spot *at, int is_row) {
    double flank = is_row ? c->flank_x : c->flank_y, top = is_row ? c->top_x : c->top_y;
    return larger(fabs(at->to_flank * flank + at->to_top * top), LEAST_SLANT);
}

/* Compare the points of a half-level outline with a shape: distances, derivatives of the distances by every parameter, and
   whether a point is used. The centre of a fillet moves with the two sides that it touches: the distance of a point on the
   fillet changes as if both sides, seen from the centre, moved along their normals. */
static void compared(const double *p, const double *origin, const double *x, const double *y, const double *u,
                     const uint8_t *is_row, const uint8_t *is_outer, const double *blur, int64_t n, double *distance,
                     double *jacobian, uint8_t *counts) {
    Corner corners[2] = {corner(p, origin, 0), corner(p, origin, 1)};
    memset(jacobian, 0, (size_t)(n * PARAMETERS) * sizeof(double));
    for (int64_t i = 0; i < n; i++) {
        int outer = is_outer[i] ? 1 : 0;
        const Corner *c = &corners[outer];
        Spot at = spot(c, x[i], y[i]);
        double *by = jacobian + i * PARAMETERS;
        double scale = 1.0 / (u[i] * slant(c, &at, is_row[i]));
        distance[i] = (at.distance + half_level(c, &at, x[i] - c->centre_x, y[i] - c->centre_y, blur[i])) * scale;
        double reach = -(SHARP_REACH * blur[i] + c->radius);
        counts[i] = c->radius >= SHARP_IN_BLURS * blur[i] || at.alpha <= reach || at.beta <= reach;
        double by_flank = -at.to_flank * c->flank_x * scale, by_top = -at.to_top * c->top_y * scale;
        double qx = x[i], qy = y[i], turning = 0.0;
        if (at.is_on_fillet) {
            /* A rotation of a side moves the centre of its fillet, which lies one radius inside the side. */
            qx = c->centre_x;
            qy = c->centre_y;
            turning = c->radius;
            by[INNER_R + outer] = (at.to_flank + at.to_top - 1.0) * scale;
        }
        by[INNER_C + outer] = by_flank;
        by[INNER_M + outer] = by_flank * (qy - origin[1] + turning * c->flank_y);
        by[TOP_C] = by_top;
        by[TOP_M] = by_top * (qx - origin[0] + turning * c->top_x);
    }
}

/* Position at which the inner side of the outline crosses a height, and its change per pixel towards the root. */
static void inner_edge(const double *p, const double *origin, double y, double *edge, double *slope) {
    Corner c = corner(p, origin, 0);
    if (y >= c.centre_y + c.radius * c.flank_y) {
        *edge = p[INNER_C] + p[INNER_M] * (y - origin[1]);
        *slope = p[INNER_M];
    } else if (y <= c.centre_y + c.radius * c.top_y) {
        double steepness = fabs(p[TOP_M]) >= LEAST_STEEPNESS ? p[TOP_M] : LEAST_STEEPNESS;
        *edge = origin[0] + (y - p[TOP_C]) / steepness;
        *slope = 1.0 / steepness;
    } else {
        double inside = within(y - c.centre_y, -0.999 * c.radius, 0.999 * c.radius);
        double half_width = sqrt(larger(c.radius * c.radius - inside * inside, 1e-12));
        *edge = c.centre_x + half_width;
        *slope = -inside / half_width;
    }
}

LOOP(finger_shape_compared, "FFFFFBBFffb", "") {
    compared(FLOATS(0), FLOATS(1), FLOATS(2), FLOATS(3), FLOATS(4), FLAGS(5), FLAGS(6), FLOATS(7), in[2].n, FLOATS(8),
             FLOATS(9), FLAGS(10));
}

/* Whether each point lies on the straight part of a flank. */
LOOP(finger_shape_on_flanks, "FFFFb", "") {
    const double *p = FLOATS(0), *origin = FLOATS(1), *x = FLOATS(2), *y = FLOATS(3);
    Corner corners[2] = {corner(p, origin, 0), corner(p, origin, 1)};
    double between = 0.5 * (corners[0].centre_x + corners[1].centre_x);
    for (int64_t i = 0; i < in[2].n; i++) {
        Spot at = spot(&corners[x[i] <= between ? 1 : 0], x[i], y[i]);
        FLAGS(4)[i] = !at.is_on_fillet && at.to_flank == 1.0;
    }
}

/* Corner to which each point belongs, and cosine between its line of pixels and the outline's normal; an error along the
   line is larger than the error along the normal by the inverse of this cosine. */
LOOP(finger_shape_seen, "FFFFBbf", "") {
    const double *p = FLOATS(0), *origin = FLOATS(1), *x = FLOATS(2), *y = FLOATS(3);
    Corner corners[2] = {corner(p, origin, 0), corner(p, origin, 1)};
    double between = 0.5 * (corners[0].centre_x + corners[1].centre_x);
    for (int64_t i = 0; i < in[2].n; i++) {
        int outer = x[i] <= between;
        const Corner *c = &corners[outer];
        Spot at = spot(c, x[i], y[i]);
        FLAGS(5)[i] = (uint8_t)outer;
        FLOATS(6)[i] = slant(c, &at, FLAGS(4)[i]);
    }
}

/* Outermost points, along the axis, of the inner and of the outer fillet: x, y, x, y. */
LOOP(finger_shape_corner_tops, "FF", "dddd") {
    for (int side = 0; side < 2; side++) {
        Corner c = corner(FLOATS(0), FLOATS(1), side);
        out[2 * side].d = c.centre_x;
        out[2 * side + 1].d = c.centre_y - c.radius;
    }
}

LOOP(finger_shape_inner_edge, "FFd", "dd") { inner_edge(FLOATS(0), FLOATS(1), in[2].d, &out[0].d, &out[1].d); }
