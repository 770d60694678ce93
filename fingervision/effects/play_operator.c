/* Follow one run's input with a play: input, full width, half widths above the first input at which the state begins. */
LOOP(play_operator_play, "Fddf", "") {
    const double *input = FLOATS(0), half = 0.5 * in[1].d;
    double state = in[0].n ? input[0] + in[2].d * half : 0.0;
    for (int64_t i = 0; i < in[0].n; i++) {
        state = smaller(larger(state, input[i] - half), input[i] + half);
        FLOATS(3)[i] = state;
    }
}
