/* The normal distribution's density and integral at many places.

   Both are tabulated at every 1/64 sigma when the library is loaded, and carried from the nearest entry by a Taylor series
   of seven terms, whose remainder is below 1e-18: a sixth of the time of erf and exp, and the same to the last digits. */

enum { STEPS_IN_SIGMA = 64, TABLE_SIGMAS = 9, TABLE_SIZE = 2 * STEPS_IN_SIGMA * TABLE_SIGMAS + 1 };
static double DENSITY[TABLE_SIZE], INTEGRAL[TABLE_SIZE];

PREPARE(normal_table) {
    for (int k = 0; k < TABLE_SIZE; k++) {
        double z = (double)k / STEPS_IN_SIGMA - TABLE_SIGMAS;
        DENSITY[k] = exp(-0.5 * z * z) / sqrt(2.0 * PI);
        INTEGRAL[k] = 0.5 * erfc(-z * sqrt(0.5));
    }
}

/* Integral up to z, and density there. Beyond nine sigma both are what they are to 1e-18: zero, or one. */
static inline double normal(double z, double *density) {
    if (!(fabs(z) < TABLE_SIGMAS - 0.5)) {
        *density = 0.0;
        return z > 0.0 ? 1.0 : 0.0;
    }
    int k = (int)(z * STEPS_IN_SIGMA + (TABLE_SIGMAS * STEPS_IN_SIGMA + 0.5));
    double a = (double)k / STEPS_IN_SIGMA - TABLE_SIGMAS, h = z - a, own = DENSITY[k];
    /* Derivatives of the density over the density: Hermite's polynomials, each from the two before it. */
    double d1 = -a, d2 = -a * d1 - 1.0, d3 = -a * d2 - 2.0 * d1, d4 = -a * d3 - 3.0 * d2, d5 = -a * d4 - 4.0 * d3;
    double d6 = -a * d5 - 5.0 * d4;
    *density = own * (1.0 + h * (d1 + h / 2.0 * (d2 + h / 3.0 * (d3 + h / 4.0 * (d4 + h / 5.0 * (d5 + h / 6.0 * d6))))));
    return INTEGRAL[k] + own * h * (1.0 + h / 2.0 * (d1 + h / 3.0 * (d2 + h / 4.0 * (d3 + h / 5.0 * (d4 + h / 6.0 * d5)))));
}

LOOP(normal_distribution_normal, "d", "dd") { out[0].d = normal(in[0].d, &out[1].d); }
