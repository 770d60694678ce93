/* after finger_end */
/* after first_guess */
/* after median */
/* Number of neighbouring points with a common residual: residuals, weights, sides. */
LOOP(residuals_shared, "FFI", "d") {
    const double *residual = FLOATS(0), *robust = FLOATS(1);
    const int64_t *side = INTS(2), n = in[2].n;
    double power = 1e-12, moving = 0.0;
    int64_t first = 0;
    while (first < n) {
        int64_t past = first;
        while (past < n && side[past] == side[first]) {
            power += robust[past] * square(residual[past]);
            past++;
        }
        for (int64_t start = first - LAGS; start < past; start++) {
            double total = 0.0;
            for (int64_t i = larger_int(start, first); i < smaller_int(start + LAGS + 1, past); i++)
                total += sqrt(robust[i]) * residual[i];
            moving += total * total;
        }
        first = past;
    }
    out[0].d = moving / ((LAGS + 1.0) * power);
}

/* Spread of the differences between residuals of neighbouring points, which is that of the noise even if a wrong shape
   causes residuals that change along the outline. */
LOOP(residuals_roughness, "FF", "d") {
    const double *residual = FLOATS(0), *robust = FLOATS(1);
    double *steps = floats(in[0].n), before = 0.0;
    int64_t count = 0, is_any = 0;
    for (int64_t i = 0; i < in[0].n; i++) {
        if (!(robust[i] > 0.0)) continue;
        if (is_any) steps[count++] = fabs(residual[i] - before);
        before = residual[i];
        is_any = 1;
    }
    out[0].d = SIGMAS_IN_MEDIAN * middle_in_place(steps, count) / sqrt(2.0);
    free(steps);
}

static int is_near(double x, double y, double edge, double height) {
    return fabs(y - height) < SHAPE_REACH_PX && fabs(x - edge) < 2.0 * SHAPE_REACH_PX;
}

/* Share of the points near the measuring point that the fit rejected as dust: x, y, weights, edge, tip, measuring height. */
LOOP(residuals_rejected, "FFFddd", "d") {
    int64_t near = 0, rejected = 0;
    for (int64_t i = 0; i < in[0].n; i++) {
        if (!is_near(FLOATS(0)[i], FLOATS(1)[i], in[3].d, in[4].d + in[5].d)) continue;
        near++;
        rejected += FLOATS(2)[i] < LEAST_COUNTED;
    }
    out[0].d = (double)rejected / (double)larger_int(near, 1);
}

/* Largest distance of rejected points just above or just below the measuring point, if they are the majority there, or half
   of the points on both sides: x, y, u, residuals, weights, edge, height. */
LOOP(residuals_set_aside, "FFFFFdd", "d") {
    double most = 0.0, half[2] = {0.0, 0.0};
    for (int side = 0; side < 2; side++) {
        int64_t beside = 0, rejected = 0;
        double worst = 0.0;
        for (int64_t i = 0; i < in[0].n; i++) {
            double down = FLOATS(1)[i] - in[6].d;
            if (!is_near(FLOATS(0)[i], FLOATS(1)[i], in[5].d, in[6].d) || (down > 0.0) != side) continue;
            int is_rejected = FLOATS(4)[i] < LEAST_COUNTED;
            if (is_rejected) worst = larger(worst, fabs(FLOATS(3)[i]) * FLOATS(2)[i]);
            if (fabs(down) > BESIDE_PX) continue;
            beside++;
            rejected += is_rejected;
        }
        if (2 * rejected > beside) most = larger(most, worst);
        if (rejected && 2 * rejected >= beside) half[side] = worst;
    }
    out[0].d = half[0] > 0.0 && half[1] > 0.0 ? larger(most, larger(half[0], half[1])) : most;
}

/* Larger of the mean residuals near the measuring point and near the tip, each in units of its own uncertainty. */
LOOP(residuals_systematic, "FFFFddd", "d") {
    const double *x = FLOATS(0), *y = FLOATS(1), *residual = FLOATS(2), *robust = FLOATS(3), tip = in[5].d;
    double sums[2] = {0.0, 0.0}, weights[2] = {0.0, 0.0};
    for (int64_t i = 0; i < in[0].n; i++) {
        int near[2] = {is_near(x[i], y[i], in[4].d, tip + in[6].d), y[i] - tip < 0.5 * SHAPE_REACH_PX};
        for (int k = 0; k < 2; k++)
            if (near[k]) {
                sums[k] += robust[i] * residual[i];
                weights[k] += robust[i];
            }
    }
    out[0].d = 0.0;
    for (int k = 0; k < 2; k++)
        if (weights[k] >= FEWEST_NEAR) out[0].d = larger(out[0].d, fabs(sums[k]) / sqrt(weights[k]));
}

/* Distance of a position from the nearest point; a large finger's outline has fewer points, with larger distances between
   them. */
LOOP(residuals_distance_in_spacings, "FFdd", "d") {
    const double *x = FLOATS(0), *y = FLOATS(1);
    double nearest = INFINITY, least_x, most_x, least_y, most_y;
    for (int64_t i = 0; i < in[0].n; i++) nearest = smaller(nearest, square(x[i] - in[2].d) + square(y[i] - in[3].d));
    ends_of(x, in[0].n, &least_x, &most_x);
    ends_of(y, in[0].n, &least_y, &most_y);
    out[0].d = sqrt(nearest) / larger(1.0, (most_x - least_x + most_y - least_y) / (double)in[0].n);
}
