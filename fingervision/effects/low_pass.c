/* Relax one run's signal towards itself: signal, time, time constant, start; what comes out. */
LOOP(low_pass_low_pass, "FFddf", "") {
    const double *signal = FLOATS(0), *time = FLOATS(1);
    double *follower = FLOATS(4), tau = in[2].d;
    if (in[0].n) follower[0] = in[3].d;
    for (int64_t i = 1; i < in[0].n; i++) {
        double step = time[i] - time[i - 1], lag = (signal[i] - signal[i - 1]) / step * tau;
        follower[i] = signal[i] - lag + (follower[i - 1] - signal[i - 1] + lag) * exp(-step / tau);
    }
}
