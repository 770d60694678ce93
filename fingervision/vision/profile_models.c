/* after linear_solve */
/* after normal_distribution */
/* The part beside the step, blurred, at a distance from the edge outwards; the step there, and its density. */
static double beside(int64_t kind, double t, double blur, double breadth, double step, double density) {
    double far_density, far;
    if (kind == WALL) /* what lies between the first step and the second */
        return step - normal((t - breadth) / blur, &far_density);
    if (kind == SHADOW) { /* falls from one at the edge to nothing at its breadth */
        far = normal((t - breadth) / blur, &far_density);
        return (1.0 - t / breadth) * (step - far) + blur / breadth * (far_density - density);
    }
    if (kind == GLARE) {
        normal((t + breadth) / blur, &far_density);
        return far_density;
    }
    if (kind == FADING) { /* falls from one at the edge as exp(-t / breadth) */
        double ratio = blur / breadth;
        return exp(0.5 * square(ratio) - t / breadth) * normal(t / blur - ratio, &far_density);
    }
    return 0.0;
}

static double addition(int64_t kind, double t, double blur, double breadth) {
    double density, step = normal(t / blur, &density);
    return beside(kind, t, blur, breadth, step, density);
}

/* Level, step, tail and addition at one place. */
static void parts_at(int64_t kind, double t, const double *p, double *row) {
    double away = t - p[POSITION], blur = p[BLUR], density, other, step = normal(away / blur, &density);
    row[0] = 1.0;
    row[1] = step;
    row[2] = normal(away / (TAIL_BLURS * blur), &other) - step;
    row[3] = beside(kind, away, blur, p[BREADTH], step, density);
}

typedef struct {
    int64_t kind, n;
    const double *t, *value, *weight;
    double *rows; /* room for n times LINEAR */
} Seen;

/* Weighted squares with the linear parameters at their best, which are put into `p`; the model goes to `model` if any.
   Negative where the linear parameters cannot be told apart. */
static double squares_of(const Seen *s, double *p, double *model) {
    int count = s->kind != STEP ? LINEAR : LINEAR - 1;
    double gram[LINEAR * LINEAR] = {0.0}, right[LINEAR] = {0.0}, total = 0.0;
    for (int64_t i = 0; i < s->n; i++) {
        double *row = s->rows + i * LINEAR;
        parts_at(s->kind, s->t[i], p, row);
        for (int a = 0; a < count; a++) {
            double weighted = s->weight[i] * row[a];
            right[a] += weighted * s->value[i];
            for (int b = 0; b <= a; b++) gram[a * count + b] += weighted * row[b];
        }
    }
    for (int a = 0; a < count; a++)
        for (int b = 0; b < a; b++) gram[b * count + a] = gram[a * count + b];
    for (int a = 0; a < count; a++) gram[a * count + a] *= 1.0 + 1e-9;
    /* The tail is small: a weak pull to nothing keeps it from standing in for a wall. */
    gram[2 * count + 2] += 0.05 * gram[1 * count + 1];
    if (!solve(gram, count, right, 1)) return -1.0;
    for (int a = 0; a < LINEAR; a++) p[a] = a < count ? right[a] : 0.0;
    for (int64_t i = 0; i < s->n; i++) {
        double found = 0.0;
        for (int a = 0; a < LINEAR; a++) found += p[a] * s->rows[i * LINEAR + a];
        total += s->weight[i] * square(s->value[i] - found);
        if (model) model[i] = found;
    }
    return total;
}

/* Fit one model to a mean profile (Levenberg and Marquardt over position, blur and breadth): kind, t, value, weight, blur,
   start, whether the blur is known, limits of the breadth, squares that are too many; whether it went, and the fit. */
LOOP(profile_models_fit_profile, "iFFFddiddd", "bdddddd") {
    int64_t n = in[1].n, kind = in[0].i;
    int free_count = kind != STEP ? 3 : 2, is_blur_known = (int)in[6].i;
    double p[PARAMETERS] = {0.0}, matrix[9] = {0.0}, right[3] = {0.0}, damping = 1e-2;
    double *base = floats(n * (1 + 1 + 3 + LINEAR)), *other = base + n, *jacobian = base + 2 * n;
    Seen s = {kind, n, FLOATS(1), FLOATS(2), FLOATS(3), base + 5 * n};
    p[BLUR] = in[4].d;
    p[BREADTH] = in[5].d;
    if (kind == WALL) p[POSITION] = -0.5 * in[5].d;
    out[0].i = 0;
    double best = squares_of(&s, p, base);
    if (best < 0.0) goto done;
    for (int iteration = 0; iteration < ITERATIONS; iteration++) {
        for (int a = 0; a < free_count; a++) {
            double moved[PARAMETERS];
            if (a == 1 && is_blur_known) { /* its row and column are taken out below */
                for (int64_t i = 0; i < n; i++) jacobian[n + i] = 0.0;
                continue;
            }
            memcpy(moved, p, sizeof moved);
            moved[POSITION + a] += 1e-4;
            if (squares_of(&s, moved, other) < 0.0) goto done;
            for (int64_t i = 0; i < n; i++) jacobian[a * n + i] = (other[i] - base[i]) / 1e-4;
        }
        for (int a = 0; a < free_count; a++) {
            right[a] = 0.0;
            for (int64_t i = 0; i < n; i++) right[a] += s.weight[i] * jacobian[a * n + i] * (s.value[i] - base[i]);
            for (int b = 0; b < free_count; b++) {
                double total = 0.0;
                for (int64_t i = 0; i < n; i++) total += s.weight[i] * jacobian[a * n + i] * jacobian[b * n + i];
                matrix[a * 3 + b] = total;
            }
        }
        if (is_blur_known) {
            for (int a = 0; a < free_count; a++) matrix[3 + a] = matrix[a * 3 + 1] = 0.0;
            matrix[4] = 1.0;
            right[1] = 0.0;
        }
        /* What stands at its limit and is drawn beyond it stays there: the others go on as if it were known. */
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
                memcpy(base, other, (size_t)n * sizeof(double));
                damping = larger(0.3 * damping, 1e-6);
                break;
            }
            damping *= 4.0;
        }
        if (!has_moved) break;
    }
    /* The blur alone hardly shows in one profile: the other edges of the picture tell it to a part. */
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
    free(base);
}

LOOP(profile_models_addition, "iddd", "d") { out[0].d = addition(in[0].i, in[1].d, in[2].d, in[3].d); }
