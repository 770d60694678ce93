/* Point (across, along) at which the first or the last part of an outline, followed over a top, crosses a height. */
static void side_at(const int32_t *outline, int64_t n, int is_last, double height, double *across, double *along) {
    int64_t i = is_last ? n - 1 : 0, step = is_last ? -1 : 1;
    while (i + step >= 0 && i + step < n && outline[2 * i + 1] > height) i += step;
    *across = outline[2 * i];
    *along = outline[2 * i + 1];
}

/* Number of rows beyond a tip in which the finger continues with its own width. Arguments: mask with the tips up; outline
   from one side over the top to the other; row of the tip; heights below the tip between which lines are fitted to the
   sides; searched distance beyond the tip. */
LOOP(crossing_rows_beyond, "pOiddi", "i") {
    const int32_t *outline = POINTS(1);
    int64_t n = in[1].shape[0], top = in[2].i, columns = in[0].shape[1], rows = 0;
    double across[2], along[2], lean[2];
    for (int side = 0; side < 2; side++) {
        double far_across, far_along;
        side_at(outline, n, side, (double)top + in[3].d, &across[side], &along[side]);
        side_at(outline, n, side, (double)top + in[4].d, &far_across, &far_along);
        lean[side] = (across[side] - far_across) / larger(far_along - along[side], 1.0);
    }
    int first = across[0] > across[1];
    for (int64_t row = top - 2; row >= 0 && row >= top - in[5].i; row--) {
        int64_t a = (int64_t)rint(across[first] + lean[first] * (along[first] - (double)row));
        int64_t b = (int64_t)rint(across[1 - first] + lean[1 - first] * (along[1 - first] - (double)row));
        int64_t filled = 0, wide = b - a + 1;
        if (wide < 2 || a - SIDE_PX < 0 || b + SIDE_PX >= columns) continue;
        if (pixel(&in[0], row, a - SIDE_PX) || pixel(&in[0], row, b + SIDE_PX)) continue;
        for (int64_t x = a; x <= b; x++) filled += pixel(&in[0], row, x) != 0;
        rows += (double)filled >= FILLED_SHARE * (double)wide;
    }
    out[0].i = rows;
}
