/* Follow one run's input at no more than a speed, from its first sample on: input, time, speed; what follows. */
LOOP(slew_limit_follow, "FFdf", "") {
    const double *input = FLOATS(0), *time = FLOATS(1);
    double state = in[0].n ? input[0] : 0.0;
    for (int64_t i = 0; i < in[0].n; i++) {
        double reach = i ? in[2].d * (time[i] - time[i - 1]) : 0.0;
        state += smaller(larger(input[i] - state, -reach), reach);
        FLOATS(3)[i] = state;
    }
}
