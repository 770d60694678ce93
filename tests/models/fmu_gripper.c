/* A gripper as an FMU for the tests: rest gap 1.2 mm, ratio 7.7, one mode of 40 Hz. Lengths in metres.
   Built with -DFMI=2 or 3; what the tests' importer does not call is left to stubs. */
#include <math.h>
#include <stdlib.h>

typedef struct { double time, input, state[2]; } Gripper;
static const double REST_M = 1.2e-3, RATIO = 7.7, OMEGA = 251.3274, DAMPING = 0.3;

static void rates(const Gripper *g, double *out) {
    out[0] = g->state[1];
    out[1] = OMEGA * OMEGA * (RATIO * g->input - g->state[0]) - 2.0 * DAMPING * OMEGA * g->state[1];
}
static double gap(const Gripper *g) { return REST_M + g->state[0]; }
static void begin(Gripper *g) { g->state[0] = RATIO * g->input; g->state[1] = 0.0; }
static void advance(Gripper *g, double step) {
    int count = (int)ceil(step / 1e-4);
    double h = step / count, k1[2], k2[2];
    for (int i = 0; i < count; i++) { /* midpoint rule */
        Gripper half = *g;
        rates(g, k1);
        half.state[0] += 0.5 * h * k1[0]; half.state[1] += 0.5 * h * k1[1];
        rates(&half, k2);
        g->state[0] += h * k2[0]; g->state[1] += h * k2[1];
    }
    g->time += step;
#ifdef CRASH
    if (g->time > 1.0) *(volatile int *)0 = 1;
#endif
#ifdef HANG
    for (;;) { volatile int i = 0; (void)i; }
#endif
}
static double get(const Gripper *g, unsigned reference) {
    double d[2];
    rates(g, d);
    switch (reference) {
        case 1: return g->input;
        case 2: return gap(g);
        case 3: case 4: return g->state[reference - 3];
        case 5: case 6: return d[reference - 5];
        default: return g->time;
    }
}
typedef int (*Any)(void);

#if FMI == 2
typedef struct { int newDiscreteStatesNeeded, terminateSimulation, nominalsChanged, valuesChanged, nextEventTimeDefined;
    double nextEventTime; } Event;
void *fmi2Instantiate(const char *n, int t, const char *id, const char *r, const void *f, int v, int l) {
    return calloc(1, sizeof(Gripper)); }
void fmi2FreeInstance(void *g) { free(g); }
int fmi2SetupExperiment(void *g, int d, double tol, double start, int e, double stop) {
    ((Gripper *)g)->time = start; return 0; }
int fmi2EnterInitializationMode(void *g) { return 0; }
int fmi2ExitInitializationMode(void *g) { begin(g); return 0; }
int fmi2Terminate(void *g) { return 0; }
int fmi2SetReal(void *g, const unsigned *r, size_t n, const double *v) {
    for (size_t i = 0; i < n; i++) if (r[i] == 1) ((Gripper *)g)->input = v[i];
    return 0; }
int fmi2GetReal(void *g, const unsigned *r, size_t n, double *v) {
    for (size_t i = 0; i < n; i++) v[i] = get(g, r[i]);
    return 0; }
int fmi2DoStep(void *g, double t, double h, int no) { advance(g, h); return 0; }
int fmi2EnterEventMode(void *g) { return 0; }
int fmi2NewDiscreteStates(void *g, Event *e) { Event none = {0, 0, 0, 0, 0, 0.0}; *e = none; return 0; }
int fmi2EnterContinuousTimeMode(void *g) { return 0; }
int fmi2CompletedIntegratorStep(void *g, int no, int *enter, int *stop) { *enter = *stop = 0; return 0; }
int fmi2SetTime(void *g, double t) { ((Gripper *)g)->time = t; return 0; }
int fmi2SetContinuousStates(void *g, const double *x, size_t n) {
    for (size_t i = 0; i < n; i++) ((Gripper *)g)->state[i] = x[i];
    return 0; }
int fmi2GetContinuousStates(void *g, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = ((Gripper *)g)->state[i];
    return 0; }
int fmi2GetDerivatives(void *g, double *x, size_t n) { rates(g, x); return 0; }
int fmi2GetEventIndicators(void *g, double *z, size_t n) { return 0; }
int fmi2GetNominalsOfContinuousStates(void *g, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1e-3;
    return 0; }
#else
void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, char v, char l, char e, char y,
    const unsigned *q, size_t m, void *c, Any a, Any b) { return calloc(1, sizeof(Gripper)); }
void *fmi3InstantiateModelExchange(const char *n, const char *t, const char *r, char v, char l, void *c, Any a) {
    return calloc(1, sizeof(Gripper)); }
void fmi3FreeInstance(void *g) { free(g); }
int fmi3EnterInitializationMode(void *g, char d, double tol, double start, char e, double stop) {
    ((Gripper *)g)->time = start; return 0; }
int fmi3ExitInitializationMode(void *g) { begin(g); return 0; }
int fmi3Terminate(void *g) { return 0; }
int fmi3SetFloat64(void *g, const unsigned *r, size_t n, const double *v, size_t m) {
    for (size_t i = 0; i < n; i++) if (r[i] == 1) ((Gripper *)g)->input = v[i];
    return 0; }
int fmi3GetFloat64(void *g, const unsigned *r, size_t n, double *v, size_t m) {
    for (size_t i = 0; i < n; i++) v[i] = get(g, r[i]);
    return 0; }
int fmi3DoStep(void *g, double t, double h, char no, char *event, char *stop, char *early, double *last) {
    advance(g, h); *event = *stop = *early = 0; *last = t + h; return 0; }
int fmi3EnterEventMode(void *g) { return 0; }
int fmi3EnterStepMode(void *g) { return 0; }
int fmi3UpdateDiscreteStates(void *g, char *a, char *b, char *c, char *d, char *e, double *f) {
    *a = *b = *c = *d = *e = 0; *f = 0.0; return 0; }
int fmi3EnterContinuousTimeMode(void *g) { return 0; }
int fmi3CompletedIntegratorStep(void *g, char no, char *enter, char *stop) { *enter = *stop = 0; return 0; }
int fmi3SetTime(void *g, double t) { ((Gripper *)g)->time = t; return 0; }
int fmi3SetContinuousStates(void *g, const double *x, size_t n) {
    for (size_t i = 0; i < n; i++) ((Gripper *)g)->state[i] = x[i];
    return 0; }
int fmi3GetContinuousStates(void *g, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = ((Gripper *)g)->state[i];
    return 0; }
int fmi3GetContinuousStateDerivatives(void *g, double *x, size_t n) { rates(g, x); return 0; }
int fmi3GetEventIndicators(void *g, double *z, size_t n) { return 0; }
int fmi3GetNominalsOfContinuousStates(void *g, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1e-3;
    return 0; }
int fmi3GetNumberOfEventIndicators(void *g, size_t *n) { *n = 0; return 0; }
int fmi3GetNumberOfContinuousStates(void *g, size_t *n) { *n = 2; return 0; }
#endif
