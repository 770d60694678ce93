/* after finger_shape */
/* after linear_solve */
/* after normal_distribution */
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

/* Component of a vector along the first or the second side of a corner. */
static double along_side(const Corner *c, int two, double x, double y) {
    return two ? c->top_x * y - c->top_y * x : c->flank_x * y - c->flank_y * x;
}

/* A straight piece of a chain's outline: a side, or one of the facets that stand for a fillet. Outward unit normal n, offset
   n . q, coordinates of its ends along the direction (-n_y, n_x), and how far it moves outward when the two sides of its corner
   and the radius do. */
typedef struct {
    double nx, ny, k, begin, end, to_one, to_two, to_radius;
    int64_t of;
    int is_facet;
} Piece;

/* Pieces of a chain in their order, each between its intersections with its neighbours. Returns their number. */
static int64_t pieces_of(const double *sides, const Corner *corners, int64_t count, Piece *pieces) {
    int64_t n = 0;
    for (int64_t k = 0; k < count; k++) {
        const double *one = sides + 3 * k;
        double nx = sin(one[2]), ny = -cos(one[2]);
        pieces[n++] = (Piece){nx, ny, nx * one[0] + ny * one[1], -INFINITY, INFINITY, 1.0, 0.0, 0.0, k, 0};
        if (k == count - 1) break;
        const Corner *c = &corners[k];
        double turn = remainder(one[5] - one[2], 2.0 * PI);
        for (int64_t j = 1; j <= FACETS && c->radius > 0.0; j++) {
            double from_one = turn * (double)j / (FACETS + 1.0);
            double to_one = sin(turn - from_one) / sin(turn), to_two = sin(from_one) / sin(turn);
            nx = sin(one[2] + from_one);
            ny = -cos(one[2] + from_one);
            double offset = nx * c->centre_x + ny * c->centre_y + c->radius;
            pieces[n++] = (Piece){nx, ny, offset, 0.0, 0.0, to_one, to_two, 1.0 - to_one - to_two, k, 1};
        }
    }
    for (int64_t j = 0; j + 1 < n; j++) {
        Piece *one = &pieces[j], *two = &pieces[j + 1];
        double determinant = one->nx * two->ny - one->ny * two->nx;
        double x = (one->k * two->ny - two->k * one->ny) / determinant, y = (one->nx * two->k - two->nx * one->k) / determinant;
        one->end = x * -one->ny + y * one->nx;
        two->begin = x * -two->ny + y * two->nx;
    }
    return n;
}

/* Owen's function T(h, t / h): the share of a normal distribution in the plane that lies beyond a line at distance h >= 0,
   within the angle from the foot of the perpendicular to the point at t along the line (Ann. Math. Stat. 27, 1956, 1075,
   doi:10.1214/aoms/1177728074); by Gauss and Legendre's rule of ten points. */
static double owens_t(double h, double t) {
    static const double at[5] = {0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845,
                                 0.9739065285171717};
    static const double weight[5] = {0.2955242247147529, 0.2692667193099963, 0.2190863625159820, 0.1494513491505806,
                                     0.0666713443086881};
    if (t < 0.0) return -owens_t(h, -t);
    if (t > h) {
        double density, near = normal(h, &density), far = normal(t, &density);
        return t > TABLE_SIGMAS ? 0.5 - 0.5 * near : 0.5 * (near + far) - near * far - owens_t(t, h);
    }
    double steepness = t / larger(h, 1e-300), sum = 0.0;
    for (int j = 0; j < 10; j++) {
        double x = 0.5 * steepness * (j % 2 ? 1.0 - at[j / 2] : 1.0 + at[j / 2]), squares = 1.0 + square(x);
        sum += weight[j / 2] * exp(-0.5 * square(h) * squares) / squares;
    }
    return sum * 0.25 * steepness / PI;
}

/* Number of standard deviations below which a normal distribution has a share. */
static double normal_quantile(double share, double start) {
    double z = within(start, -DEEPEST, DEEPEST), density;
    for (int look = 0; look < 20; look++) {
        double away = (normal(z, &density) - share) / larger(density, 1e-12);
        double step = within(away / larger(1.0 + 0.5 * z * away, 0.5), -1.0, 1.0);
        z -= step;
        if (fabs(step) < 1e-10) break;
    }
    return within(z, -DEEPEST, DEEPEST);
}

/* Distance of a point along the normal from the contour of a chain, and the factor by which it is divided: the uncertainty
   along the normal. */
typedef struct {
    double distance, normal_u;
} Away;

/* Whether a point is near the outline and so near one of its corners that the blur mixes two pieces there. */
static int is_beside_corner(const Piece *pieces, int64_t n, double x, double y, double blur) {
    double outside = -INFINITY;
    int is_near = 0;
    for (int64_t j = 0; j < n; j++) {
        const Piece *p = &pieces[j];
        double depth = p->k - p->nx * x - p->ny * y, past = p->nx * y - p->ny * x - p->end;
        outside = larger(outside, -depth);
        is_near |= larger(fabs(depth), fabs(past)) < REACH * blur;
    }
    return is_near && fabs(outside) < DEEPEST * blur;
}

/* Exact distance from the half-level contour of a blurred chain. The light is the share of a normal distribution about the
   point that lies within the chain: the angles under which its pieces are seen, less what lies beyond them, which is a
   difference of Owen's functions. A displacement of a piece changes the light by the density along it. Where the light rises
   less steeply than at a straight edge, because normals of several directions are mixed, a straight step does not read the
   half-level exactly. */
static Away from_light(const Piece *pieces, int64_t n, const double *sides, const Corner *corners, int64_t count, double x,
                       double y, double u, int is_row, double blur, double share, double *by) {
    double angles = PI - (sides[3 * count - 1] - sides[2]), beyond = 0.0, outside = -INFINITY, density;
    double gradient_x = 0.0, gradient_y = 0.0, weight[MOST_PIECES], moment[MOST_PIECES];
    for (int64_t j = 0; j < n; j++) {
        const Piece *p = &pieces[j];
        double h = (p->k - p->nx * x - p->ny * y) / blur, at = p->nx * y - p->ny * x, inward = h < 0.0 ? -1.0 : 1.0;
        double from = (p->begin - at) / blur, to = (p->end - at) / blur, d_from, d_to;
        outside = larger(outside, -h);
        angles += inward * (atan2(to, fabs(h)) - atan2(from, fabs(h)));
        weight[j] = moment[j] = 0.0;
        if (!(fabs(h) < REACH && from < REACH && to > -REACH)) continue;
        double span = -normal(from, &d_from) + normal(to, &d_to);
        beyond += inward * (owens_t(fabs(h), to) - owens_t(fabs(h), from));
        normal(h, &density);
        weight[j] = density * span;
        moment[j] = density * (at * span + blur * (d_from - d_to));
        gradient_x += p->nx * weight[j];
        gradient_y += p->ny * weight[j];
    }
    double gradient = larger(hypot(gradient_x, gradient_y), 1e-12);
    double z = normal_quantile(angles / (2.0 * PI) - beyond, -outside);
    normal(z, &density);
    for (int64_t j = 0; by && j < n; j++) {
        const Piece *p = &pieces[j];
        double moved = share * weight[j] / gradient;
        for (int two = 0; two < 2; two++) {
            double to = two ? p->to_two : p->to_one;
            const double *side = sides + 3 * (p->of + two);
            if (moved == 0.0 || to == 0.0) continue;
            double along = moment[j] / weight[j] + p->ny * side[0] - p->nx * side[1];
            const Corner *c = &corners[p->of];
            if (p->is_facet) along = along_side(c, two, c->centre_x - side[0], c->centre_y - side[1]);
            by[p->of + two] -= moved * to;
            by[count + p->of + two] += moved * to * along;
        }
        if (p->is_facet) by[2 * count + p->of] -= moved * p->to_radius;
    }
    double steepness = within(gradient / density, LEAST_RISE, 1.0);
    double slanted = larger(fabs(is_row ? gradient_x : gradient_y) / gradient, LEAST_SLANT);
    return (Away){-z * blur / steepness, hypot(u * slanted, U_CORNER_IN_BLURS * blur * sqrt(1.0 - square(steepness)))};
}

/* The same from the nearest side or fillet of a corner, which is displaced by half the blur's variance times its curvature. The
   derivative by the radius is taken from a corner whose radius is larger by STEP_PX. */
static Away from_fillet(const Corner *c, const Corner *wider, const double *sides, double x, double y, double u, int is_row,
                        double blur, double share, double *by, int64_t count) {
    Spot at = spot(c, x, y);
    Away found = {at.distance + half_level(c, &at, x - c->centre_x, y - c->centre_y, blur), u * slant(c, &at, is_row)};
    if (!by) return found;
    Spot wide = spot(wider, x, y);
    double outside = wide.distance + half_level(wider, &wide, x - wider->centre_x, y - wider->centre_y, blur);
    by[2 * count] += share * (outside - found.distance) / STEP_PX;
    for (int two = 0; two < 2; two++) {
        const double *side = sides + 3 * two;
        double to = share * (two ? at.to_top : at.to_flank), dx = x - side[0], dy = y - side[1];
        if (at.is_on_fillet) {
            /* A rotation of a side moves the centre of its fillet, which lies one radius inside the side. */
            dx = c->centre_x + c->radius * (two ? c->top_x : c->flank_x) - side[0];
            dy = c->centre_y + c->radius * (two ? c->top_y : c->flank_y) - side[1];
        }
        by[two] -= to;
        by[count + two] += to * along_side(c, two, dx, dy);
    }
    return found;
}

/* Corner to which a point belongs: near a convex outline, the nearest side is the one of which a point lies farthest outside,
   and the nearest corner is at that end of the side which is on the point's side of its middle. */
static int64_t corner_of(const Corner *sharp, int64_t count, double x, double y) {
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
    return (middle_x - x) * sharp[k].flank_y + (y - middle_y) * sharp[k].flank_x > 0.0 ? k : k - 1;
}

/* Distances of the points of a half-level outline from the contour of a blurred chain, in units of their uncertainties, and
   their derivatives by a displacement of every side, by a rotation of every side, and by every radius. The arguments are
   those of chain_fit. A chain that is not blurred is compared where a fit is still far from its end. Returns 0 if the sides are
   not convex. */
static int from_chain(const Arg *in, int is_blurred) {
    int64_t count = in[0].n / 3, unknowns = 3 * count - 1;
    const double *sides = FLOATS(0), *radii = FLOATS(1), *blur = FLOATS(7);
    Corner corners[MOST_SIDES], wider[MOST_SIDES], sharp[MOST_SIDES];
    Piece pieces[MOST_PIECES];
    for (int64_t k = 0; k + 1 < count; k++) {
        const double *one = sides + 3 * k, *two = one + 3;
        double turn = remainder(two[2] - one[2], 2.0 * PI);
        if (!(turn > LEAST_TURN && turn < MOST_TURN)) return 0;
        corners[k] = chain_corner(one, two, radii[k]);
        wider[k] = chain_corner(one, two, radii[k] + STEP_PX);
        sharp[k] = chain_corner(one, two, 0.0);
    }
    int64_t n = pieces_of(sides, corners, count, pieces);
    memset(FLOATS(12), 0, (size_t)in[12].n * sizeof(double));
    for (int64_t i = 0; i < in[3].n; i++) {
        double x = FLOATS(3)[i], y = FLOATS(4)[i], u = FLOATS(5)[i], *by = in[12].n ? FLOATS(12) + i * unknowns : NULL;
        int64_t k = corner_of(sharp, count, x, y);
        const Corner *c = &corners[k];
        double share = within((ROUND_ABOVE - c->radius / blur[i]) / (ROUND_ABOVE - SHARP_BELOW), 0.0, 1.0);
        if (!is_blurred || (share > 0.0 && !is_beside_corner(pieces, n, x, y, blur[i]))) share = 0.0;
        Away found = {0.0, 0.0};
        if (share > 0.0) {
            Away exact = from_light(pieces, n, sides, corners, count, x, y, u, FLAGS(6)[i], blur[i], share, by);
            found = (Away){share * exact.distance, share * exact.normal_u};
        }
        if (share < 1.0) {
            Away round = from_fillet(c, &wider[k], sides + 3 * k, x, y, u, FLAGS(6)[i], blur[i], 1.0 - share,
                                     by ? by + k : NULL, count);
            found.distance += (1.0 - share) * round.distance;
            found.normal_u += (1.0 - share) * round.normal_u;
        }
        FLOATS(11)[i] = found.distance / found.normal_u;
        for (int64_t a = 0; by && a < unknowns; a++) by[a] /= found.normal_u;
    }
    return 1;
}

/* Weighted squares and products of the derivatives, and of derivatives and distances, with the priors of all unknowns. */
static void weighed_chain(const Arg *in, double patience, const double *away, const double *prior, double *information,
                          double *gradient) {
    int64_t unknowns = in[13].n;
    double variance = in[9].d;
    memset(information, 0, (size_t)(unknowns * unknowns) * sizeof(double));
    for (int64_t a = 0; a < unknowns; a++) {
        information[a * unknowns + a] = prior[a];
        gradient[a] = prior[a] * away[a];
    }
    for (int64_t i = 0; i < in[3].n; i++) {
        const double *by = FLOATS(12) + i * unknowns;
        double residual = FLOATS(11)[i], squares = square(residual / patience) / variance;
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
   the priors (m); x, y, u, is_row, blur; patience of every step; factor on the variances; results, information (m, m) with
   m = 3 n - 1, residuals, derivatives (points, m; or none, and no information, where only the residuals are wanted), and how far
   every unknown is from its prior's mean (m). Returns whether the sides are convex. */
LOOP(chain_fit, "ffFFFFBFFdffff", "b") {
    int64_t count = in[0].n / 3, unknowns = 3 * count - 1;
    double *sides = FLOATS(0), *radii = FLOATS(1), *away = FLOATS(13), *information = FLOATS(10);
    double prior[3 * MOST_SIDES], gradient[3 * MOST_SIDES], matrix[9 * MOST_SIDES * MOST_SIDES];
    for (int64_t a = 0; a < unknowns; a++) {
        prior[a] = 1.0 / square(FLOATS(2)[a]);
        away[a] = a < 2 * count ? 0.0 : radii[a - 2 * count];
    }
    for (int64_t look = 0; look < in[8].n; look++) {
        double patience = FLOATS(8)[look], most = MOST_TURNED, length = 0.0;
        if (!from_chain(in, patience == 1.0)) {
            out[0].i = 0;
            return;
        }
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
        if (patience == 1.0 && length < SETTLED) break;
    }
    out[0].i = from_chain(in, 1);
    if (in[12].n) weighed_chain(in, 1.0, away, prior, information, gradient);
}
