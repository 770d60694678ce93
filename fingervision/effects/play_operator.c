/* Follow one run's input with a play: input, full width, half widths above the first input at which the state begins. */
LOOP(play_operator_play, "Fddf", "") {
    const double *input = FLOATS(0), half = 0.5 * in[1].d;
    double state = in[0].n ? input[0] + in[2].d * half : 0.0;
    for (int64_t i = 0; i < in[0].n; i++) {
        state = smaller(larger(state, input[i] - half), input[i] + half);
        FLOATS(3)[i] = state;
    }
}

/* What elastic sliders withhold of one run's input in all: input, largest reach, how many sliders, start in reaches. */
LOOP(play_operator_sliders, "Fdidf", "") {
    const double *input = FLOATS(0);
    const int64_t n = in[0].n, count = in[2].i;
    double *drawn = FLOATS(4);
    for (int64_t i = 0; i < n; i++) drawn[i] = 0.0;
    for (int64_t k = 1; k <= count; k++) {
        const double half = 0.5 * (2.0 * in[1].d * (double)k / (double)count);
        double state = n ? input[0] + in[3].d * half : 0.0;
        for (int64_t i = 0; i < n; i++) {
            state = smaller(larger(state, input[i] - half), input[i] + half);
            drawn[i] += input[i] - state;
        }
    }
}
