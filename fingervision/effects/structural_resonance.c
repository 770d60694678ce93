/* Drive a second-order system with one run's signal, at rest at the first sample: signal, time, frequency, damping ratio
   (below 1); what it does. Exact for a signal that is linear between samples. */
LOOP(structural_resonance_ring, "FFddf", "") {
    const double *signal = FLOATS(0), *time = FLOATS(1), damping = in[3].d;
    double omega = 2.0 * PI * in[2].d, damped = omega * sqrt(1.0 - damping * damping), decay = damping * omega;
    double x = in[0].n ? signal[0] : 0.0, v = 0.0;
    if (in[0].n) FLOATS(4)[0] = x;
    for (int64_t i = 1; i < in[0].n; i++) {
        double step = time[i] - time[i - 1], slope = (signal[i] - signal[i - 1]) / step, lag = 2.0 * damping * slope / omega;
        double a = x - signal[i - 1] + lag, b = (v - slope + decay * a) / damped;
        double e = exp(-decay * step), c = cos(damped * step), s = sin(damped * step);
        x = signal[i] - lag + e * (a * c + b * s);
        v = slope + e * ((damped * b - decay * a) * c - (damped * a + decay * b) * s);
        FLOATS(4)[i] = x;
    }
}
