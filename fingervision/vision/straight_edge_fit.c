/* after linear_solve */
/* after normal_distribution */
/* The design matrix is stored pixel by pixel, with these columns: level; slope of the level along the edges; for each edge,
   its step, and its step times the distance along; derivatives by its position and by its slope; derivative by the blur; to
   find slopes of the light, also the distance across, and this distance times the light. */

enum { STRAIGHT_MOST_EDGES = MOST_EDGES, STRAIGHT_MOST_COLUMNS = 5 + 4 * STRAIGHT_MOST_EDGES, STRAIGHT_WANTED = 2 * STRAIGHT_MOST_EDGES };
/* Reasons why no fit was possible, in the order of the sentences in WHY_NOT. */
enum { STRAIGHT_FITTED, STRAIGHT_TOO_FEW, STRAIGHT_NO_CONTRAST, STRAIGHT_NOT_SETTLED, STRAIGHT_UNDETERMINED };

typedef struct {
    const double *levels;
    int64_t height, width, pixels;
    int edges, columns, ramps;
    double x0, y0, direction, half_length, blur, inside;
    double position[STRAIGHT_MOST_EDGES], slope[STRAIGHT_MOST_EDGES], contrast[STRAIGHT_MOST_EDGES];
    double *t, *s, *seen, *design;
    int64_t *at;
    double scale[STRAIGHT_MOST_COLUMNS], normal[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS], found[STRAIGHT_MOST_COLUMNS];
} StraightFit;

static double straight_band_reach(double blur) { return REACH_SIGMAS * sqrt(blur * blur + ROUNDING) + REACH_EXTRA_PX; }

/* Pixels near the edges, within the length of the band. */
static void straight_gather(StraightFit *f, double reach) {
    int low = 0, high = 0;
    for (int k = 1; k < f->edges; k++) {
        if (f->position[k] < f->position[low]) low = k;
        if (f->position[k] > f->position[high]) high = k;
    }
    double cosine = cos(f->direction), sine = sin(f->direction);
    f->pixels = 0;
    for (int64_t row = 0; row < f->height; row++)
        for (int64_t column = 0; column < f->width; column++) {
            double x = (double)column + f->x0, y = (double)row + f->y0;
            double s = -sine * x + cosine * y, t = cosine * x + sine * y;
            if (!(fabs(s) <= f->half_length) || !(t - f->position[low] - f->slope[low] * s >= -reach) ||
                !(t - f->position[high] - f->slope[high] * s <= reach))
                continue;
            f->t[f->pixels] = t;
            f->s[f->pixels] = s;
            f->at[f->pixels] = row * f->width + column;
            f->seen[f->pixels++] = f->levels[row * f->width + column];
        }
}

/* Fill the design matrix: only its linear columns, or all columns. */
static void straight_fill(StraightFit *f, int is_whole) {
    int edges = f->edges, m = f->columns = is_whole ? 3 + 4 * edges + f->ramps : 2 + 2 * edges;
    double cosine[STRAIGHT_MOST_EDGES], wide[STRAIGHT_MOST_EDGES], sigma[STRAIGHT_MOST_EDGES];
    for (int k = 0; k < edges; k++) {
        double normal_at = f->direction - atan(f->slope[k]), a = fabs(cos(normal_at)), b = fabs(sin(normal_at));
        cosine[k] = 1.0 / sqrt(1.0 + f->slope[k] * f->slope[k]);
        wide[k] = larger(a, b);
        sigma[k] = sqrt(f->blur * f->blur + square(smaller(a, b)) / 12.0);
    }
    for (int64_t i = 0; i < f->pixels; i++) {
        double *d = f->design + i * m, s = f->s[i], by_blur = 0.0, light = f->inside;
        d[0] = 1.0;
        d[1] = s;
        for (int k = 0; k < edges; k++) {
            double away = (f->t[i] - f->position[k] - f->slope[k] * s) * cosine[k], p_upper, p_lower;
            double upper = (away + 0.5 * wide[k]) / sigma[k], lower = (away - 0.5 * wide[k]) / sigma[k];
            double n_upper = normal(upper, &p_upper), n_lower = normal(lower, &p_lower);
            double by_sigma = (p_upper - p_lower) / wide[k];
            double step = (sigma[k] / wide[k]) * (upper * n_upper - lower * n_lower) + sigma[k] * by_sigma;
            d[2 + k] = step;
            d[2 + edges + k] = step * s;
            if (!is_whole) continue;
            double moved = f->contrast[k] * (-cosine[k] * ((n_upper - n_lower) / wide[k]));
            d[2 + 2 * edges + k] = moved;
            d[2 + 3 * edges + k] = moved * s;
            by_blur += f->contrast[k] * (by_sigma * (f->blur / sigma[k]));
            light += f->contrast[k] * step;
        }
        if (!is_whole) continue;
        d[2 + 4 * edges] = by_blur;
        if (!f->ramps) continue;
        d[3 + 4 * edges] = f->t[i] - f->position[0] - f->slope[0] * s;
        d[4 + 4 * edges] = d[3 + 4 * edges] * light;
    }
}

/* Gram matrix of the columns with weighted pixels, and products of the columns with other values. */
static void straight_gram(const StraightFit *f, const double *weight, int power, const double *values, double *matrix, double *right) {
    int m = f->columns;
    memset(matrix, 0, (size_t)(m * m) * sizeof(double));
    if (right) memset(right, 0, (size_t)m * sizeof(double));
    for (int64_t i = 0; i < f->pixels; i++) {
        const double *d = f->design + i * m;
        double w = weight ? (power == 2 ? weight[i] * weight[i] : weight[i]) : 1.0;
        for (int a = 0; a < m; a++) {
            double one = w * d[a], *row = matrix + a * m;
            for (int b = a; b < m; b++) row[b] += one * d[b];
        }
        if (right) {
            double value = w * values[i];
            for (int a = 0; a < m; a++) right[a] += d[a] * value;
        }
    }
    for (int a = 0; a < m; a++)
        for (int b = 0; b < a; b++) matrix[a * m + b] = matrix[b * m + a];
}

/* Least-squares solution with scaled columns; returns 0 if the pixels do not determine the parameters. */
static int straight_least_squares(StraightFit *f) {
    int m = f->columns;
    double work[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS];
    straight_gram(f, NULL, 1, f->seen, f->normal, f->found);
    for (int a = 0; a < m; a++) {
        f->scale[a] = sqrt(f->normal[a * m + a]);
        if (f->scale[a] == 0.0) f->scale[a] = 1.0;
    }
    for (int a = 0; a < m; a++) {
        for (int b = 0; b < m; b++) f->normal[a * m + b] /= f->scale[a] * f->scale[b];
        f->normal[a * m + a] += RIDGE;
        f->found[a] /= f->scale[a];
    }
    memcpy(work, f->normal, (size_t)(m * m) * sizeof(double));
    if (!solve(work, m, f->found, 1)) return 0;
    for (int a = 0; a < m; a++) f->found[a] /= f->scale[a];
    return 1;
}

static int straight_invert(const double *matrix, int m, double *inverse) {
    double work[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS];
    memcpy(work, matrix, (size_t)(m * m) * sizeof(double));
    for (int i = 0; i < m * m; i++) inverse[i] = i % (m + 1) == 0 ? 1.0 : 0.0;
    return solve(work, m, inverse, m);
}

/* One Gauss-Newton step; returns the largest displacement of an edge. */
static int straight_newton(StraightFit *f, int *has_contrast, double *change) {
    int edges = f->edges;
    if (!*has_contrast) {
        straight_fill(f, 0);
        if (!straight_least_squares(f)) return STRAIGHT_UNDETERMINED;
        memcpy(f->contrast, f->found + 2, (size_t)edges * sizeof(double));
        *has_contrast = 1;
    }
    for (int k = 0; k < edges; k++)
        if (!(fabs(f->contrast[k]) > LEAST_CONTRAST)) return STRAIGHT_NO_CONTRAST;
    straight_fill(f, 1);
    if (!straight_least_squares(f)) return STRAIGHT_UNDETERMINED;
    double farthest = 0.0, widest = 0.0, low = f->s[0], high = f->s[0];
    for (int k = 0; k < edges; k++) {
        double now = f->found[2 + k], ratio = fabs(now) > LEAST_CONTRAST ? within(f->contrast[k] / now, 0.0, 1.0) : 0.0;
        double move = within(ratio * f->found[2 + 2 * edges + k], -LARGEST_STEP_PX, LARGEST_STEP_PX);
        double turn = within(ratio * f->found[2 + 3 * edges + k], -LARGEST_TURN, LARGEST_TURN);
        f->contrast[k] = now;
        f->position[k] += move;
        f->slope[k] += turn;
        farthest = larger(farthest, fabs(move));
        widest = larger(widest, fabs(turn));
    }
    for (int64_t i = 1; i < f->pixels; i++) {
        low = smaller(low, f->s[i]);
        high = larger(high, f->s[i]);
    }
    double before = f->blur;
    f->inside = f->found[0];
    f->blur += within(f->found[f->columns - 1], -0.3 * before, 0.5 * before);
    f->blur = within(f->blur, SMALLEST_BLUR_PX, LARGEST_BLUR_PX);
    *change = larger(larger(farthest, 0.5 * (high - low) * widest), 0.1 * fabs(f->blur - before));
    return isfinite(*change) ? STRAIGHT_FITTED : STRAIGHT_UNDETERMINED;
}

static int straight_settle(StraightFit *f, int has_contrast) {
    double fitted = 0.0, at[STRAIGHT_MOST_EDGES], change;
    memcpy(at, f->position, sizeof(at));
    for (int iteration = 0; iteration < ITERATIONS; iteration++) {
        double reach = straight_band_reach(f->blur), farthest = 0.0;
        for (int k = 0; k < f->edges; k++) farthest = larger(farthest, fabs(f->position[k] - at[k]));
        if (fabs(reach - fitted) > 0.5 || farthest > 0.5) {
            fitted = reach;
            memcpy(at, f->position, sizeof(at));
            straight_gather(f, reach);
            if (f->pixels < 8 * f->edges + 8) return STRAIGHT_TOO_FEW;
        }
        int why = straight_newton(f, &has_contrast, &change);
        if (why != STRAIGHT_FITTED) return why;
        if (change < SETTLED_PX && fabs(straight_band_reach(f->blur) - fitted) <= 0.5) return STRAIGHT_FITTED;
    }
    return STRAIGHT_NOT_SETTLED;
}

/* Residuals of the fit; returns the sum of their squares. */
static double straight_residuals(const StraightFit *f, double *residual) {
    double power = 0.0;
    for (int64_t i = 0; i < f->pixels; i++) {
        const double *d = f->design + i * f->columns;
        residual[i] = f->seen[i];
        for (int a = 0; a < f->columns; a++) residual[i] -= f->found[a] * d[a];
        power += residual[i] * residual[i];
    }
    return power;
}

/* Mean and covariance of two slopes of the light, given their least-squares estimates and the covariance of these: the mean
   over priors, each normal about zero, whose widths are multiples of the noise (zero, even light, is as probable as all others
   together). */
static void straight_average_slopes(const double *found, const double noise[2][2], double *mean, double spread[2][2]) {
    static const double width[RAMP_WIDTHS_COUNT] = RAMP_WIDTHS;
    double total = 0.0, first[2] = {0.0}, second[2][2] = {{0.0}}, least = INFINITY;
    for (int turn = 0; turn < 2; turn++)
        for (int i = 0; i < RAMP_WIDTHS_COUNT * RAMP_WIDTHS_COUNT; i++) {
            int k = i / RAMP_WIDTHS_COUNT, l = i % RAMP_WIDTHS_COUNT;
            double prior[2] = {square(width[k]) * noise[0][0], square(width[l]) * noise[1][1]}, own[2];
            double a = noise[0][0] + prior[0], b = noise[0][1], c = noise[1][1] + prior[1], area = a * c - b * b;
            double solved[2] = {(c * found[0] - b * found[1]) / area, (a * found[1] - b * found[0]) / area};
            double unlikely = 0.5 * (log(area) + found[0] * solved[0] + found[1] * solved[1]);
            if (!turn) {
                least = smaller(least, unlikely);
                continue;
            }
            double weight = exp(least - unlikely) * (k ? 1.0 : RAMP_WIDTHS_COUNT - 1.0) * (l ? 1.0 : RAMP_WIDTHS_COUNT - 1.0);
            const double inverse[2][2] = {{c / area, -b / area}, {-b / area, a / area}};
            total += weight;
            for (int p = 0; p < 2; p++) own[p] = prior[p] * solved[p];
            for (int p = 0; p < 2; p++) {
                first[p] += weight * own[p];
                for (int q = 0; q < 2; q++)
                    second[p][q] += weight * (own[p] * own[q] + (p == q ? prior[p] : 0.0) - prior[p] * inverse[p][q] * prior[q]);
            }
        }
    for (int p = 0; p < 2; p++) mean[p] = first[p] / total;
    for (int p = 0; p < 2; p++)
        for (int q = 0; q < 2; q++) spread[p][q] = second[p][q] / total - mean[p] * mean[q];
}

/* Subtract from the levels the slopes of the light across the edges, which move edges between sides of different slopes: one
   that is equal on both sides, and one in proportion to the light, as of uneven illumination. Their uncertainty is the
   covariance `added` of positions and slopes. */
static void straight_level_light(StraightFit *f, double *levels, double *residual, double *inverse, double shared, double *added) {
    int edges = f->edges, wanted = 2 * edges, m = 5 + 4 * edges;
    double noise[2][2], mean[2], spread[2][2], effect[STRAIGHT_WANTED][2];
    memset(added, 0, (size_t)(wanted * wanted) * sizeof(double));
    f->ramps = 2;
    straight_fill(f, 1);
    f->ramps = 0;
    if (!straight_least_squares(f) || !straight_invert(f->normal, m, inverse)) return;
    double variance = straight_residuals(f, residual) / (double)larger_int(f->pixels - m, 1);
    variance = larger(variance, ROUNDING) * larger(shared, 1.0);
    for (int p = 0; p < 2; p++)
        for (int q = 0; q < 2; q++)
            noise[p][q] = variance * inverse[(m - 2 + p) * m + m - 2 + q] / (f->scale[m - 2 + p] * f->scale[m - 2 + q]);
    double area = noise[0][0] * noise[1][1] - noise[0][1] * noise[1][0];
    if (!(area > 0.0)) return;
    straight_average_slopes(f->found + m - 2, noise, mean, spread);
    for (int j = 0; j < wanted; j++) {
        int own = 2 + wanted + j;
        double by[2];
        for (int p = 0; p < 2; p++) by[p] = variance * inverse[own * m + m - 2 + p] / (f->scale[own] * f->scale[m - 2 + p]);
        for (int p = 0; p < 2; p++) effect[j][p] = (by[p] * noise[1 - p][1 - p] - by[1 - p] * noise[0][1]) / area;
    }
    for (int i = 0; i < wanted * wanted; i++)
        for (int p = 0; p < 2; p++)
            for (int q = 0; q < 2; q++) added[i] += effect[i / wanted][p] * spread[p][q] * effect[i % wanted][q];
    /* The band of the next fit may lie up to a pixel aside. */
    straight_gather(f, straight_band_reach(f->blur) + 1.0);
    f->ramps = 2;
    straight_fill(f, 1);
    f->ramps = 0;
    for (int64_t i = 0; i < f->pixels; i++)
        for (int p = 0; p < 2; p++) levels[f->at[i]] -= mean[p] * f->design[i * m + m - 2 + p];
    f->levels = levels;
}

/* Sum of products of every pixel's value and that of its neighbour at a lag; `place` is the index of each position of the
   picture in the list of pixels, -1 if it is not in the list. */
static double straight_lagged(const StraightFit *f, const double *values, const int32_t *place, int64_t down, int64_t right) {
    double total = 0.0;
    for (int64_t i = 0; i < f->pixels; i++) {
        int64_t row = f->at[i] / f->width + down, column = f->at[i] % f->width + right;
        if (row >= f->height || column < 0 || column >= f->width) continue;
        int32_t other = place[row * f->width + column];
        if (other >= 0) total += values[i] * values[other];
    }
    return total;
}

/* Variance of positions and slopes divided by its value for independent noise of the pixels. */
static void straight_share_noise(const StraightFit *f, const double *residual, const double *inverse, double power, double *shared) {
    static const int lags[LAGS_COUNT][2] = LAGS;
    int wanted = 2 * f->edges, m = f->columns, is_any = 0;
    double correlation[LAGS_COUNT], limit = CORRELATED / sqrt((double)f->pixels);
    int32_t *place = (int32_t *)room(f->height * f->width, sizeof(int32_t));
    memset(place, 0xff, (size_t)(f->height * f->width) * sizeof(int32_t));
    for (int64_t i = 0; i < f->pixels; i++) place[f->at[i]] = (int32_t)i;
    for (int l = 0; l < LAGS_COUNT; l++) {
        correlation[l] = straight_lagged(f, residual, place, lags[l][0], lags[l][1]) / power;
        if (fabs(correlation[l]) > limit) is_any = 1;
        else correlation[l] = 0.0;
    }
    for (int j = 0; j < wanted; j++) shared[j] = 1.0;
    double *effect = is_any ? floats(f->pixels) : NULL;
    for (int j = 0; is_any && j < wanted; j++) {
        double alone = 0.0, total = 1.0;
        for (int64_t i = 0; i < f->pixels; i++) {
            const double *d = f->design + i * m, *row = inverse + (2 + wanted + j) * m;
            double sum = 0.0;
            for (int a = 0; a < m; a++) sum += row[a] / f->scale[a] * d[a];
            effect[i] = sum;
            alone += sum * sum;
        }
        for (int l = 0; l < LAGS_COUNT; l++)
            if (correlation[l] != 0.0) total += 2.0 * correlation[l] * straight_lagged(f, effect, place, lags[l][0], lags[l][1]) / alone;
        shared[j] = larger(total, 1.0);
    }
    free(effect);
    free(place);
}

/* Ratio of the scatter of an edge's pieces to their noise, bend of the first edge, and least contrast of its pieces as a
   share of the edge's contrast. */
static double straight_pieces(const StraightFit *f, const double *residual, double variance, double *bend, double *least) {
    static const double quantile[CHI_SQUARE_999_COUNT] = CHI_SQUARE_999;
    int m = f->columns, edges = f->edges;
    int64_t count[PIECES] = {0};
    uint8_t *piece = (uint8_t *)room(f->pixels, 1);
    double half = 0.0, worst = 1.0, mean[PIECES] = {0.0}, power[PIECES] = {0.0}, more[PIECES] = {0.0};
    for (int64_t i = 0; i < f->pixels; i++) half = larger(half, fabs(f->s[i]));
    half += 1e-9;
    for (int64_t i = 0; i < f->pixels; i++) {
        int own = (int)((f->s[i] / half + 1.0) * 0.5 * PIECES);
        piece[i] = (uint8_t)(own < PIECES - 1 ? own : PIECES - 1);
        count[piece[i]]++;
        mean[piece[i]] += f->design[i * m + 2];
    }
    for (int k = 0; k < edges; k++) {
        double info[PIECES] = {0.0}, score[PIECES] = {0.0}, chi_square = 0.0;
        for (int64_t i = 0; i < f->pixels; i++) {
            double by_position = f->design[i * m + 2 + 2 * edges + k];
            info[piece[i]] += by_position * by_position;
            score[piece[i]] += by_position * residual[i];
        }
        for (int p = 0; p < PIECES; p++) {
            info[p] = larger(info[p], 1e-12);
            chi_square += score[p] * score[p] / info[p];
        }
        chi_square /= variance;
        if (chi_square > quantile[PIECES]) worst = larger(worst, chi_square / (PIECES - 2));
        if (k) continue;
        double total = 0.0, about = 0.0, above = 0.0, below = 0.0;
        for (int p = 0; p < PIECES; p++) total += info[p];
        for (int p = 0; p < PIECES; p++) about += info[p] / total * square((p + 0.5) / PIECES * 2.0 - 1.0);
        for (int p = 0; p < PIECES; p++) {
            double bent = square((p + 0.5) / PIECES * 2.0 - 1.0) - about;
            above += info[p] / total * bent * (score[p] / info[p]);
            below += info[p] / total * bent * bent;
        }
        *bend = fabs(above / larger(below, 1e-12));
    }
    for (int p = 0; p < PIECES; p++) mean[p] /= (double)larger_int(count[p], 1);
    for (int64_t i = 0; i < f->pixels; i++) {
        double centred = f->design[i * m + 2] - mean[piece[i]];
        power[piece[i]] += centred * centred;
        more[piece[i]] += centred * residual[i];
    }
    for (int p = 0; p < PIECES; p++) {
        double own = (f->contrast[0] + more[p] / larger(power[p], 1e-12)) / f->contrast[0];
        *least = p ? smaller(*least, own) : own;
    }
    free(piece);
    return worst;
}

/* Add the misfit of the flanks to the variance of the positions if the misfit exceeds the noise (Hausman). */
static void straight_add_misfit(const StraightFit *f, const double *residual, double variance, double *covariance) {
    int m = f->columns, wanted = 2 * f->edges;
    double width = CORE_SIGMAS * sqrt(f->blur * f->blur + ROUNDING) + 0.5, *weight = floats(f->pixels);
    double flanks[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS], squares[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS], core[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS];
    double right[STRAIGHT_MOST_COLUMNS];
    for (int64_t i = 0; i < f->pixels; i++) {
        weight[i] = 0.0;
        for (int k = 0; k < f->edges; k++)
            weight[i] += exp(-0.5 * square((f->t[i] - f->position[k] - f->slope[k] * f->s[i]) / width));
    }
    straight_gram(f, weight, 1, residual, flanks, right);
    straight_gram(f, weight, 2, NULL, squares, NULL);
    for (int a = 0; a < m; a++) {
        right[a] /= f->scale[a];
        for (int b = 0; b < m; b++) {
            flanks[a * m + b] /= f->scale[a] * f->scale[b];
            squares[a * m + b] /= f->scale[a] * f->scale[b];
        }
        flanks[a * m + a] *= 1.0 + 1e-9;
    }
    if (straight_invert(flanks, m, core))
        for (int j = 0; j < f->edges; j++) {
            int own = 2 + wanted + j;
            double change = 0.0, spread = 0.0, known = covariance[j * wanted + j];
            for (int a = 0; a < m; a++) {
                double sum = 0.0;
                for (int b = 0; b < m; b++) sum += squares[a * m + b] * core[b * m + own];
                spread += core[own * m + a] * sum;
                change += core[own * m + a] * right[a];
            }
            change = square(change / f->scale[own]);
            spread *= variance / square(f->scale[own]);
            if (change > HAUSMAN * HAUSMAN * larger(spread - known, 0.25 * known)) covariance[j * wanted + j] += change;
        }
    free(weight);
}

/* Share of the first edge's contrast that clipping removed, from the curvature of its profile, and the standard uncertainty
   of this share. */
static void straight_cut_off_share(const StraightFit *f, const double *residual, double variance, int64_t cut_off, double *lost) {
    int m = f->columns, is_up = f->contrast[0] * (double)cut_off > 0.0;
    double *bend = floats(f->pixels), work[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS], found[STRAIGHT_MOST_COLUMNS] = {0.0};
    double common = 0.0, power = 0.0, contrast = fabs(f->contrast[0]);
    for (int64_t i = 0; i < f->pixels; i++) {
        const double *d = f->design + i * m;
        double step = is_up ? d[2] : 1.0 - d[2];
        bend[i] = (double)cut_off * (smaller((1.0 + CUT) * step, 1.0) - step);
        for (int a = 0; a < m; a++) found[a] += d[a] / f->scale[a] * bend[i];
    }
    memcpy(work, f->normal, (size_t)(m * m) * sizeof(double));
    if (!solve(work, m, found, 1)) memset(found, 0, sizeof(found));
    for (int64_t i = 0; i < f->pixels; i++) {
        const double *d = f->design + i * m;
        double own = bend[i];
        for (int a = 0; a < m; a++) own -= found[a] / f->scale[a] * d[a];
        common += own * residual[i];
        power += own * own;
    }
    power = larger(power, 1e-12);
    lost[0] = CUT * common / power / contrast;
    lost[1] = CUT * sqrt(variance / power) / contrast;
    free(bend);
}

/* Fit straight edges. Arguments: levels, position of the part's first pixel relative to the band's centre, direction,
   length, blur, number of pixels that count as one, clipped side, whether the contrasts are known; positions, slopes and
   contrasts (3, k), initially estimates, finally results; results, covariance (2 k, 2 k), level before the edges, blur,
   noise, bend, least contrast of a piece, lost share and its uncertainty. Returns the reason why no fit was possible (0:
   fitted), and the number of pixels. */
LOOP(straight_edge_fit_edges, "Fddddddiifff", "ii") {
    StraightFit fit = {0}, *f = &fit;
    double *state = FLOATS(9), *covariance = FLOATS(10), *told = FLOATS(11);
    f->levels = FLOATS(0);
    f->height = in[0].shape[0];
    f->width = in[0].shape[1];
    f->x0 = in[1].d;
    f->y0 = in[2].d;
    f->direction = in[3].d;
    f->half_length = 0.5 * in[4].d;
    f->blur = within(in[5].d, SMALLEST_BLUR_PX, LARGEST_BLUR_PX);
    out[0].i = STRAIGHT_UNDETERMINED;
    out[1].i = 0;
    if (in[9].shape[1] < 1 || in[9].shape[1] > STRAIGHT_MOST_EDGES) return;
    int edges = f->edges = (int)in[9].shape[1], wanted = 2 * edges;
    size_t bytes = (size_t)edges * sizeof(double);
    memcpy(f->position, state, bytes);
    memcpy(f->slope, state + edges, bytes);
    memcpy(f->contrast, state + 2 * edges, bytes);
    int64_t most = f->height * f->width;
    f->t = floats(most);
    f->s = floats(most);
    f->seen = floats(most);
    f->at = ints(most);
    f->design = floats(most * (5 + 4 * edges));
    double *level = floats(most), *residual = floats(most), added[STRAIGHT_WANTED * STRAIGHT_WANTED];
    memcpy(level, f->levels, (size_t)most * sizeof(double));
    double inverse[STRAIGHT_MOST_COLUMNS * STRAIGHT_MOST_COLUMNS];
    out[0].i = straight_settle(f, in[8].i != 0);
    /* A fit that does not settle may do so once the light is level. */
    if (out[0].i == STRAIGHT_FITTED || out[0].i == STRAIGHT_NOT_SETTLED) {
        straight_level_light(f, level, residual, inverse, in[6].d, added);
        out[0].i = straight_settle(f, 1);
    }
    out[1].i = f->pixels;
    if (out[0].i == STRAIGHT_FITTED && !straight_invert(f->normal, f->columns, inverse)) out[0].i = STRAIGHT_UNDETERMINED;
    if (out[0].i == STRAIGHT_FITTED) {
        int m = f->columns;
        double power = straight_residuals(f, residual), shared[STRAIGHT_WANTED];
        double variance = larger(power / (double)larger_int(f->pixels - m, 1), ROUNDING);
        straight_share_noise(f, residual, inverse, power, shared);
        double rough = straight_pieces(f, residual, variance, told + 3, told + 4);
        for (int j = 0; j < wanted; j++) shared[j] = larger(shared[j], in[6].d) * rough;
        for (int i = 0; i < wanted; i++)
            for (int j = 0; j < wanted; j++) {
                int a = 2 + wanted + i, b = 2 + wanted + j;
                covariance[i * wanted + j] =
                    variance * inverse[a * m + b] / (f->scale[a] * f->scale[b]) * sqrt(shared[i] * shared[j]);
            }
        straight_add_misfit(f, residual, variance, covariance);
        for (int i = 0; i < wanted * wanted; i++) covariance[i] += added[i];
        memcpy(state, f->position, bytes);
        memcpy(state + edges, f->slope, bytes);
        memcpy(state + 2 * edges, f->contrast, bytes);
        told[0] = f->found[0];
        told[1] = f->blur;
        told[2] = sqrt(variance);
        told[5] = told[6] = 0.0;
        if (in[7].i) straight_cut_off_share(f, residual, variance, in[7].i, told + 5);
    }
    free(f->t);
    free(f->s);
    free(f->seen);
    free(f->at);
    free(f->design);
    free(level);
    free(residual);
}
