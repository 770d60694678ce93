/* after linear_solve */
/* after normal_distribution */
/* Distance (in blurs) from the second edge of the structure beside the step, at a distance outwards from the edge. */
static inline double second_place(int64_t kind, double t, double blur, double breadth) {
    if (kind == GLARE) return (t + breadth) / blur;
    return kind == FADING ? t / blur - blur / breadth : (t - breadth) / blur;
}

/* The blurred structure beside the step, from the integral and the density of the step and of the structure's second edge.
   */
static inline double beside(
    int64_t kind, double t, double blur, double breadth, double step, double density, double far, double far_density
) {
    if (kind == WALL) return step - far; /* light between the first step and the second */
    if (kind == SHADOW) /* decreases linearly from one at the edge to zero at its breadth */
        return (1.0 - t / breadth) * (step - far) + blur / breadth * (far_density - density);
    if (kind == GLARE) return far_density;
    /* decreases from one at the edge as exp(-t / breadth) */
    if (kind == FADING) return exp(0.5 * square(blur / breadth) - t / breadth) * far;
    return 0.0;
}

static double addition(int64_t kind, double t, double blur, double breadth) {
    double density, far_density, step = normal(t / blur, &density);
    double far = normal(second_place(kind, t, blur, breadth), &far_density);
    return beside(kind, t, blur, breadth, step, density, far, far_density);
}

typedef struct {
    int64_t kind, n;
    const double *t, *value, *weight;
} Seen;

/* Values of the model's terms at every position (`unused`: memory for densities that no term needs), and the sums of their
   products that do not depend on the breadth. */
typedef struct {
    double *step, *density, *tail, *addition, *model, *unused;
    double gram[LINEAR * LINEAR], right[LINEAR];
} Parts;

/* Memory for the terms at `n` positions: PARTS times n numbers. */
enum { PARTS = 6 };
static Parts parts_in(double *room, int64_t n) {
    Parts parts = {room, room + n, room + 2 * n, room + 3 * n, room + 4 * n, room + 5 * n, {0.0}, {0.0}};
    return parts;
}

/* The step, its density, and the tail, which do not depend on the breadth of the structure beside the step. */
static void put_steps(const Seen *s, const double *p, Parts *to) {
    double blur = p[BLUR];
    for (int64_t i = 0; i < s->n; i++) {
        double away = s->t[i] - p[POSITION];
        to->step[i] = away / blur;
        to->tail[i] = away / (TAIL_BLURS * blur);
    }
    normal_at_all(to->step, s->n, to->step, to->density);
    normal_at_all(to->tail, s->n, to->tail, to->unused);
    for (int64_t i = 0; i < s->n; i++) to->tail[i] -= to->step[i];
}

static inline void put_additions_of(int64_t kind, const Seen *s, const double *p, const Parts *steps, double *addition) {
    double *far_density = steps->unused;
    for (int64_t i = 0; i < s->n; i++) addition[i] = second_place(kind, s->t[i] - p[POSITION], p[BLUR], p[BREADTH]);
    normal_at_all(addition, s->n, addition, far_density);
    for (int64_t i = 0; i < s->n; i++)
        addition[i] = beside(
            kind, s->t[i] - p[POSITION], p[BLUR], p[BREADTH], steps->step[i], steps->density[i], addition[i], far_density[i]
        );
}

/* The structure beside the step, with a separate loop for each kind, so that the loops contain no branches. */
static void put_additions(const Seen *s, const double *p, const Parts *steps, double *addition) {
    if (s->kind == WALL) put_additions_of(WALL, s, p, steps, addition);
    else if (s->kind == SHADOW) put_additions_of(SHADOW, s, p, steps, addition);
    else if (s->kind == GLARE) put_additions_of(GLARE, s, p, steps, addition);
    else if (s->kind == FADING) put_additions_of(FADING, s, p, steps, addition);
}

/* Sums of weighted products of level, step, tail and light. */
static void sum_steps(const Seen *s, Parts *to) {
    double g00 = 0.0, g10 = 0.0, g11 = 0.0, g20 = 0.0, g21 = 0.0, g22 = 0.0, r0 = 0.0, r1 = 0.0, r2 = 0.0;
    for (int64_t i = 0; i < s->n; i++) {
        double weight = s->weight[i], value = s->value[i], step = to->step[i], tail = to->tail[i];
        double by_step = weight * step, by_tail = weight * tail;
        g00 += weight;
        g10 += by_step;
        g11 += by_step * step;
        g20 += by_tail;
        g21 += by_tail * step;
        g22 += by_tail * tail;
        r0 += weight * value;
        r1 += by_step * value;
        r2 += by_tail * value;
    }
    double gram[] = {g00, g10, g20, 0.0, g10, g11, g21, 0.0, g20, g21, g22, 0.0, 0.0, 0.0, 0.0, 0.0}, right[] = {r0, r1, r2, 0.0};
    memcpy(to->gram, gram, sizeof gram);
    memcpy(to->right, right, sizeof right);
}

/* Weighted sum of squares for the best linear parameters, which are stored in `p`; the model is stored in `model`. Negative
   if the linear parameters are indistinguishable. */
static double squares_with(const Seen *s, double *p, const Parts *parts, const double *addition, double *model) {
    int count = s->kind != STEP ? LINEAR : LINEAR - 1;
    double gram[LINEAR * LINEAR], right[LINEAR], total = 0.0;
    for (int a = 0; a < count; a++) {
        right[a] = parts->right[a];
        for (int b = 0; b < count; b++) gram[a * count + b] = parts->gram[a * LINEAR + b];
    }
    if (count == LINEAR) {
        double g0 = 0.0, g1 = 0.0, g2 = 0.0, g3 = 0.0, r = 0.0;
        for (int64_t i = 0; i < s->n; i++) {
            double weighted = s->weight[i] * addition[i];
            g0 += weighted;
            g1 += weighted * parts->step[i];
            g2 += weighted * parts->tail[i];
            g3 += weighted * addition[i];
            r += weighted * s->value[i];
        }
        gram[12] = gram[3] = g0;
        gram[13] = gram[7] = g1;
        gram[14] = gram[11] = g2;
        gram[15] = g3;
        right[3] = r;
    }
    for (int a = 0; a < count; a++) gram[a * count + a] *= 1.0 + 1e-9;
    /* The tail is small: a weak prior at zero prevents the tail from replacing a wall. */
    gram[2 * count + 2] += 0.05 * gram[1 * count + 1];
    if (!solve(gram, count, right, 1)) return -1.0;
    for (int a = 0; a < LINEAR; a++) p[a] = a < count ? right[a] : 0.0;
    if (count == LINEAR)
        for (int64_t i = 0; i < s->n; i++) model[i] = p[0] + p[1] * parts->step[i] + p[2] * parts->tail[i] + p[3] * addition[i];
    else
        for (int64_t i = 0; i < s->n; i++) model[i] = p[0] + p[1] * parts->step[i] + p[2] * parts->tail[i];
    for (int64_t i = 0; i < s->n; i++) total += s->weight[i] * square(s->value[i] - model[i]);
    return total;
}

/* Weighted sum of squares after all terms are computed again; terms and model are stored in `to`. */
static double squares_of(const Seen *s, double *p, Parts *to) {
    put_steps(s, p, to);
    put_additions(s, p, to, to->addition);
    sum_steps(s, to);
    return squares_with(s, p, to, to->addition, to->model);
}

/* Sums of weighted products of the derivatives with one another and with the residuals, in one pass. */
static inline void put_normal_equations(
    int count, const Seen *s, const double *jacobian, const double *model, double *matrix, double *right
) {
    double sums[9] = {0.0}, ends[3] = {0.0};
    for (int64_t i = 0; i < s->n; i++) {
        double left = s->value[i] - model[i];
        for (int a = 0; a < count; a++) {
            double weighted = s->weight[i] * jacobian[a * s->n + i];
            ends[a] += weighted * left;
            for (int b = 0; b < count; b++) sums[a * 3 + b] += weighted * jacobian[b * s->n + i];
        }
    }
    memcpy(matrix, sums, sizeof sums);
    memcpy(right, ends, sizeof ends);
}

/* Fit one model to a mean profile (Levenberg and Marquardt over position, blur and breadth). Arguments: kind, t, value,
   weight, blur, start, whether the blur is known, limits of the breadth, sum of squares at which the fit is given up;
   result, the fit. Returns whether the fit succeeded. */
LOOP(profile_models_fit_profile, "iFFFddiddd", "bdddddd") {
    int64_t n = in[1].n, kind = in[0].i;
    int free_count = kind != STEP ? 3 : 2, is_blur_known = (int)in[6].i;
    double p[PARAMETERS] = {0.0}, matrix[9] = {0.0}, right[3] = {0.0}, damping = 1e-2;
    double *kept = floats(n * (2 * PARTS + 1 + 3)), *addition = kept + 2 * PARTS * n, *jacobian = addition + n;
    Parts two[2] = {parts_in(kept, n), parts_in(kept + PARTS * n, n)}, *base = &two[0], *other = &two[1];
    Seen s = {kind, n, FLOATS(1), FLOATS(2), FLOATS(3)};
    p[BLUR] = in[4].d;
    p[BREADTH] = in[5].d;
    if (kind == WALL) p[POSITION] = -0.5 * in[5].d;
    out[0].i = 0;
    double best = squares_of(&s, p, base);
    if (best < 0.0) goto done;
    for (int iteration = 0; iteration < ITERATIONS; iteration++) {
        for (int a = 0; a < free_count; a++) {
            double moved[PARAMETERS];
            if (a == 1 && is_blur_known) { /* its row and column are removed below */
                for (int64_t i = 0; i < n; i++) jacobian[n + i] = 0.0;
                continue;
            }
            memcpy(moved, p, sizeof moved);
            moved[POSITION + a] += 1e-4;
            if (POSITION + a == BREADTH) { /* step and tail are not changed */
                put_additions(&s, moved, base, addition);
                if (squares_with(&s, moved, base, addition, other->model) < 0.0) goto done;
            } else if (squares_of(&s, moved, other) < 0.0) goto done;
            for (int64_t i = 0; i < n; i++) jacobian[a * n + i] = (other->model[i] - base->model[i]) / 1e-4;
        }
        if (free_count == 3) put_normal_equations(3, &s, jacobian, base->model, matrix, right);
        else put_normal_equations(2, &s, jacobian, base->model, matrix, right);
        if (is_blur_known) {
            for (int a = 0; a < free_count; a++) matrix[3 + a] = matrix[a * 3 + 1] = 0.0;
            matrix[4] = 1.0;
            right[1] = 0.0;
        }
        /* A parameter at its limit that would be moved beyond the limit is kept there; the others are fitted as if it were
           known. */
        double limits[3][2] = {{-FARTHEST_PX, FARTHEST_PX}, {LEAST_BLUR_PX, LARGEST_BLUR_PX}, {in[7].d, in[8].d}};
        double free_matrix[9], free_right[3];
        memcpy(free_matrix, matrix, sizeof free_matrix);
        memcpy(free_right, right, sizeof free_right);
        for (int a = 0; a < free_count; a++) {
            int is_drawn = (p[POSITION + a] <= limits[a][0] && right[a] < 0.0) || (p[POSITION + a] >= limits[a][1] && right[a] > 0.0);
            if (!is_drawn) continue;
            for (int b = 0; b < free_count; b++) free_matrix[a * 3 + b] = free_matrix[b * 3 + a] = 0.0;
            free_matrix[a * 3 + a] = 1.0;
            free_right[a] = 0.0;
        }
        int has_moved = 0;
        for (int attempt = 0; attempt < 6; attempt++) {
            double damped[9], move[3], new[PARAMETERS];
            for (int a = 0; a < free_count; a++) {
                for (int b = 0; b < free_count; b++) damped[a * free_count + b] = free_matrix[a * 3 + b];
                damped[a * free_count + a] = free_matrix[a * 3 + a] * (1.0 + damping) + 1e-12;
                move[a] = free_right[a];
            }
            if (!solve(damped, free_count, move, 1)) goto done;
            memcpy(new, p, sizeof new);
            for (int a = 0; a < free_count; a++) new[POSITION + a] += within(move[a], -1.0, 1.0);
            for (int a = 0; a < free_count; a++) new[POSITION + a] = within(new[POSITION + a], limits[a][0], limits[a][1]);
            double squares = squares_of(&s, new, other);
            if (squares < 0.0) goto done;
            if (squares < best) {
                has_moved = best - squares > (squares > in[9].d ? SLOW : SETTLED) * best;
                best = squares;
                memcpy(p, new, sizeof p);
                Parts *better = other;
                other = base;
                base = better;
                damping = larger(0.3 * damping, 1e-6);
                break;
            }
            damping *= 4.0;
        }
        if (!has_moved) break;
    }
    /* A single profile hardly determines the blur; the other edges of the picture determine it approximately. */
    double last[9], unit[3] = {1.0, 0.0, 0.0};
    matrix[4] += 1.0 / square(U_BLUR * p[BLUR]);
    for (int a = 0; a < free_count; a++)
        for (int b = 0; b < free_count; b++)
            last[a * free_count + b] = a == b ? matrix[a * 3 + a] * (1.0 + 1e-9) + 1e-12 : matrix[a * 3 + b];
    if (!solve(last, free_count, unit, 1)) goto done;
    double contrast = fabs(p[1]) > 1e-9 ? p[1] : 1e-9, share = p[3] / contrast;
    if (kind == GLARE) share /= p[BLUR] * sqrt(2.0 * PI);
    out[0].i = 1;
    out[1].d = best;
    out[2].d = p[POSITION];
    out[3].d = sqrt(larger(unit[0], 0.0));
    out[4].d = p[BREADTH];
    out[5].d = share;
    out[6].d = p[BLUR];
done:
    free(kept);
}

LOOP(profile_models_addition, "iddd", "d") { out[0].d = addition(in[0].i, in[1].d, in[2].d, in[3].d); }
