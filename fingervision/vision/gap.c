/* after median */
/* Lines of both fingers in a part of their entries. Arguments: weight, contrast, whether clipped (2, PLACES), first entry,
   and entry after the last; results, lines of the left and of the right finger, their median contrast, and number of clipped
   lines. */
LOOP(gap_lines_within, "FFBii", "iidi") {
    int64_t places = in[0].shape[1], count = 0, clipped = 0, before;
    double *contrast = floats(2 * places);
    for (int k = 0; k < 2; k++) {
        before = count;
        for (int64_t i = k * places + in[3].i; i < k * places + in[4].i; i++)
            if (FLOATS(0)[i] > 0.0) {
                contrast[count++] = FLOATS(1)[i];
                clipped += FLAGS(2)[i] != 0;
            }
        out[k].i = count - before;
    }
    out[2].d = middle_in_place(contrast, count);
    out[3].i = clipped;
    free(contrast);
}
