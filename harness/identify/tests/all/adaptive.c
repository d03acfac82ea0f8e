/* A mass on a spring that swings in a plane, as an FMU 2.0 whose Co-Simulation has an adaptive solver of its own:
 * Bogacki and Shampine's pair of order 3(2), whose step doubles or halves. The steps go past the communication
 * points and outputs are interpolated, so that the error jumps where the pattern of steps changes. A change of the
 * input restarts the solver. -DTOLERANCE=… is the relative tolerance; with -DDEAF the tolerance of fmi2SetupExperiment is ignored;
 * with -DROUGH each step depends on the seventh digit of r, as a solver with Newton's iterations and many orders does;
 * with -DMODEL_EXCHANGE the FMU offers Model Exchange, too. The equations, with the hinge accelerated by a along x:
 *
 *   r'' = r phi'^2 + g cos(phi) - k/m (r - L) - d/m r' - a sin(phi)
 *   r phi'' = -2 r' phi' - g sin(phi) - c r phi' - a cos(phi)
 */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef int Status;
typedef const char *String;
enum { OK, WARNING, DISCARD, ERROR };
struct event_info {
    int needed, terminate, nominals, values, defined;
    double next;
};

enum { STATES = 4 };
/* Value references: the states, their derivatives, and then parameters and the input A. UNUSED has no effect. */
enum { R, V, PHI, W, DERIVATIVES, M = 8, K, D, L, C, UNUSED, A, COUNT };

typedef struct {
    double value[COUNT]; /* the states have their values at the communication point */
    double tolerance, t;
    int is_running;
    /* The solver's last step, from x0 with slope f0 at t0 to x1 with slope f1 at t0 + h, and the length of the next step. */
    double t0, h, next, x0[STATES], f0[STATES], x1[STATES], f1[STATES];
} Model, *Component;

static void rates(const Model *m, const double *x, double *f)
{
    const double *p = m->value, g = 9.81;
    f[R] = x[V];
    f[PHI] = x[W];
    f[V] = x[R] * x[W] * x[W] + g * cos(x[PHI]) - p[K] / p[M] * (x[R] - p[L]) - p[D] / p[M] * x[V]
        - p[A] * sin(x[PHI]);
    f[W] = (-2 * x[V] * x[W] - g * sin(x[PHI]) - p[A] * cos(x[PHI])) / x[R] - p[C] * x[W];
}

/* Makes a step of the solver from the end of its last step. */
static int advance(Model *m)
{
    double f2[STATES], f3[STATES], at[STATES];
    int i, tries;
    m->t0 += m->h;
    memcpy(m->x0, m->x1, sizeof m->x0);
    memcpy(m->f0, m->f1, sizeof m->f0);
    for (tries = 0; tries < 60; tries++) {
        double h = m->next, error = 0;
        for (i = 0; i < STATES; i++)
            at[i] = m->x0[i] + h / 2 * m->f0[i];
        rates(m, at, f2);
        for (i = 0; i < STATES; i++)
            at[i] = m->x0[i] + 3 * h / 4 * f2[i];
        rates(m, at, f3);
        for (i = 0; i < STATES; i++)
            m->x1[i] = m->x0[i] + h / 9 * (2 * m->f0[i] + 3 * f2[i] + 4 * f3[i]);
        rates(m, m->x1, m->f1);
        for (i = 0; i < STATES; i++) {
            double e = h * (-5 * m->f0[i] / 72 + f2[i] / 12 + f3[i] / 9 - m->f1[i] / 8);
            error = fmax(error, fabs(e) / (m->tolerance * (0.1 + fabs(m->x1[i]))));
        }
        if (!(error <= 1)) {
            m->next = h / 2;
            continue;
        }
        m->h = h;
        if (error < 0.08)
            m->next = 2 * h;
#ifdef ROUGH
        m->next *= 0.75 + 0.25 * fmod(1e7 * fabs(m->x1[R]), 1.0);
#endif
        return 1;
    }
    return 0;
}

static void restart(Model *m)
{
    memcpy(m->x1, m->value, sizeof m->x1);
    rates(m, m->x1, m->f1);
    m->t0 = m->t;
    m->h = 0;
    m->next = 0.01;
}

String fmi2GetTypesPlatform(void) { return "default"; }
String fmi2GetVersion(void) { return "2.0"; }

Component fmi2Instantiate(String name, int type, String guid, String resources, const void *host,
                          int visible, int logging)
{
    static const double start[] = { [R] = 1.2, [PHI] = 0.3, [M] = 1, [K] = 40, [L] = 1, [C] = 0.02 };
    Component m = calloc(1, sizeof *m);
    (void)name, (void)type, (void)guid, (void)resources, (void)host, (void)visible, (void)logging;
    if (m) {
        memcpy(m->value, start, sizeof start);
        m->tolerance = TOLERANCE;
    }
    return m;
}
void fmi2FreeInstance(Component m) { free(m); }
Status fmi2SetupExperiment(Component m, int tolerant, double tolerance, double start, int stops, double stop)
{
    (void)stops, (void)stop;
    m->t = start;
#ifdef DEAF
    (void)tolerant, (void)tolerance;
#else
    if (tolerant)
        m->tolerance = tolerance;
#endif
    return OK;
}
Status fmi2EnterInitializationMode(Component m) { return m ? OK : ERROR; }
Status fmi2ExitInitializationMode(Component m)
{
    restart(m);
    m->is_running = 1;
    return OK;
}
Status fmi2GetReal(Component m, const unsigned *r, size_t n, double *x)
{
    double f[STATES];
    rates(m, m->value, f);
    for (size_t i = 0; i < n; i++)
        x[i] = r[i] >= DERIVATIVES && r[i] < DERIVATIVES + STATES ? f[r[i] - DERIVATIVES] : m->value[r[i]];
    return OK;
}
Status fmi2SetReal(Component m, const unsigned *r, size_t n, const double *x)
{
    int jumps = 0;
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= COUNT || !isfinite(x[i]) || ((r[i] == M || r[i] == L || r[i] == R) && x[i] <= 0))
            return ERROR;
        jumps |= r[i] == A && x[i] != m->value[A];
        m->value[r[i]] = x[i];
    }
    if (jumps && m->is_running)
        restart(m);
    return OK;
}
Status fmi2DoStep(Component m, double t, double h, int forget)
{
    int i;
    (void)forget;
    m->t = t + h;
    while (m->t0 + m->h < m->t)
        if (!advance(m))
            return ERROR;
    for (i = 0; i < STATES; i++) {
        double s = (m->t - m->t0) / m->h, rise = m->x1[i] - m->x0[i];
        m->value[i] = m->x0[i] + s * rise
            + s * (s - 1) * ((1 - 2 * s) * rise + m->h * ((s - 1) * m->f0[i] + s * m->f1[i]));
    }
    return OK;
}

#ifdef MODEL_EXCHANGE
Status fmi2EnterEventMode(Component m) { return m ? OK : ERROR; }
Status fmi2NewDiscreteStates(Component m, struct event_info *info)
{
    memset(info, 0, sizeof *info);
    return m ? OK : ERROR;
}
Status fmi2EnterContinuousTimeMode(Component m) { return m ? OK : ERROR; }
Status fmi2CompletedIntegratorStep(Component m, int forget, int *enter, int *terminate)
{
    (void)forget;
    *enter = *terminate = 0;
    return m ? OK : ERROR;
}
Status fmi2SetTime(Component m, double t)
{
    m->t = t;
    return OK;
}
Status fmi2SetContinuousStates(Component m, const double *x, size_t n)
{
    memcpy(m->value, x, n * sizeof *x);
    return OK;
}
Status fmi2GetDerivatives(Component m, double *x, size_t n)
{
    (void)n;
    rates(m, m->value, x);
    return OK;
}
Status fmi2GetEventIndicators(Component m, double *x, size_t n)
{
    (void)x, (void)n;
    return m ? OK : ERROR;
}
Status fmi2GetContinuousStates(Component m, double *x, size_t n)
{
    memcpy(x, m->value, n * sizeof *x);
    return OK;
}
Status fmi2GetNominalsOfContinuousStates(Component m, double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        x[i] = 1;
    return m ? OK : ERROR;
}
#endif

/* Functions that an FMU must export, but that the host does not call in these tests. */
#define ABSENT(name) \
    Status name(void) { return ERROR; }
ABSENT(fmi2SetDebugLogging)
ABSENT(fmi2Terminate)
ABSENT(fmi2Reset)
ABSENT(fmi2GetInteger)
ABSENT(fmi2GetBoolean)
ABSENT(fmi2GetString)
ABSENT(fmi2SetInteger)
ABSENT(fmi2SetBoolean)
ABSENT(fmi2SetString)
ABSENT(fmi2GetFMUstate)
ABSENT(fmi2SetFMUstate)
ABSENT(fmi2FreeFMUstate)
ABSENT(fmi2SerializedFMUstateSize)
ABSENT(fmi2SerializeFMUstate)
ABSENT(fmi2DeSerializeFMUstate)
ABSENT(fmi2GetDirectionalDerivative)
ABSENT(fmi2SetRealInputDerivatives)
ABSENT(fmi2GetRealOutputDerivatives)
ABSENT(fmi2CancelStep)
ABSENT(fmi2GetStatus)
ABSENT(fmi2GetRealStatus)
ABSENT(fmi2GetIntegerStatus)
ABSENT(fmi2GetBooleanStatus)
ABSENT(fmi2GetStringStatus)
