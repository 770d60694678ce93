/* Hold one run's input until it has moved on by more than a jump: input, jump; what is held. */
LOOP(stick_slip_stick, "Fdf", "") {
    const double *input = FLOATS(0);
    double state = in[0].n ? input[0] : 0.0;
    for (int64_t i = 0; i < in[0].n; i++) {
        if (fabs(input[i] - state) > in[1].d) state = input[i];
        FLOATS(2)[i] = state;
    }
}
