/* FMUs of FMI 2 with the variables and equations of the Reference FMUs of the Modelica Association, written anew:
   Feedthrough (default), BouncingBall, VanDerPol, Stair. What the tests' importer does not call is left to stubs. */
#include <stdlib.h>

#if defined(BALL) || defined(POL)
#define STATES 2
#else
#define STATES 0
#endif
typedef struct { double time, x[2], in[3]; int whole; } Model;

static void rates(const Model *m, double *out) {
#if defined(BALL)
    out[0] = m->x[1]; out[1] = -9.81;
#elif defined(POL)
    out[0] = m->x[1]; out[1] = (1.0 - m->x[0] * m->x[0]) * m->x[1] - m->x[0];
#endif
}
static void advance(Model *m, double step) {
    int count = (int)(step / 1e-3) + 1;
    double h = step / count, d[2];
    for (int i = 0; i < count && STATES; i++) {
        rates(m, d);
        m->x[0] += h * d[0]; m->x[1] += h * d[1];
#ifdef BALL
        if (m->x[0] < 0.0 && m->x[1] < 0.0) { m->x[0] = 0.0; m->x[1] *= -0.7; }
#endif
    }
    m->time += step;
}
typedef struct { int more, stop, nominals, values, next; double at; } Event;
void *fmi2Instantiate(const char *n, int t, const char *id, const char *r, const void *f, int v, int l) {
    Model *m = calloc(1, sizeof(Model));
#if defined(BALL)
    m->x[0] = 1.0;
#elif defined(POL)
    m->x[0] = 2.0;
#endif
    return m; }
void fmi2FreeInstance(void *m) { free(m); }
int fmi2SetupExperiment(void *m, int d, double tol, double start, int e, double stop) {
    ((Model *)m)->time = start; return 0; }
int fmi2EnterInitializationMode(void *m) { return 0; }
int fmi2ExitInitializationMode(void *m) { return 0; }
int fmi2Terminate(void *m) { return 0; }
int fmi2SetReal(void *m, const unsigned *r, size_t n, const double *v) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] == 2) ((Model *)m)->in[0] = v[i];
        if (r[i] == 4) ((Model *)m)->in[1] = v[i];
    }
    return 0; }
int fmi2GetReal(void *m, const unsigned *r, size_t n, double *v) {
    const Model *g = m;
    for (size_t i = 0; i < n; i++) {
        v[i] = STATES ? g->x[r[i] % 2] : r[i] == 3 ? g->in[0] : r[i] == 5 ? g->in[1] : 0.0;
    }
    return 0; }
int fmi2GetInteger(void *m, const unsigned *r, size_t n, int *v) {
    for (size_t i = 0; i < n; i++) v[i] = 1 + (int)((Model *)m)->time;
    return 0; }
int fmi2DoStep(void *m, double t, double h, int no) { advance(m, h); return 0; }
int fmi2EnterEventMode(void *m) { return 0; }
int fmi2NewDiscreteStates(void *m, Event *e) { Event none = {0, 0, 0, 0, 0, 0.0}; *e = none; return 0; }
int fmi2EnterContinuousTimeMode(void *m) { return 0; }
int fmi2CompletedIntegratorStep(void *m, int no, int *enter, int *stop) { *enter = *stop = 0; return 0; }
int fmi2SetTime(void *m, double t) { ((Model *)m)->time = t; return 0; }
int fmi2SetContinuousStates(void *m, const double *x, size_t n) {
    for (size_t i = 0; i < n; i++) ((Model *)m)->x[i] = x[i];
    return 0; }
int fmi2GetContinuousStates(void *m, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = ((Model *)m)->x[i];
    return 0; }
int fmi2GetDerivatives(void *m, double *x, size_t n) { rates(m, x); return 0; }
int fmi2GetEventIndicators(void *m, double *z, size_t n) { return 0; }
int fmi2GetNominalsOfContinuousStates(void *m, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return 0; }
