/* A small FMU 3.0 without a fault, for the tests of `hubslosh check` and of the host: x' = -k (x - u), solved
 * exactly for inputs that change linearly, and a counter that counts every PERIOD s. With event mode the counter
 * changes only in event mode; with early return a step ends at this time. The digits in `fault` select one of the
 * faults that the test lists. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef MUTANT
#define MUTANT "00"
#endif
static const volatile char fault[] = "MUTANT=" MUTANT; /* the tests overwrite the digits in the compiled binary */
#define IS(n) ((fault[7] - '0') * 10 + fault[8] - '0' == (n))
#define PERIOD 0.25
#define TOKEN "{model3}"

typedef int Status;
enum { OK, WARNING, DISCARD, ERROR };
typedef const char *String;
typedef void (*Log)(void *, Status, String, String);
typedef void (*Update)(void *, double, bool, bool, bool, bool, bool *, double *);

/* value references: independent, state, derivative, input, fixed parameter, output, counter, indicator, array, switch */
enum { T = 1, X, DX, U, K, Y, N, Z, A, ON, COUNT };
enum mode { INSTANTIATED, INITIALIZATION, EVENT, STEP, CONTINUOUS, TERMINATED };

struct state {
    uint64_t size;
    enum mode mode;
    double t, x, u, k, next, a[3];
    int32_t n;
    bool on, due, below;
    uint64_t check; /* the last field, so that truncated bytes lack it */
};
typedef struct {
    bool exchange, events, early;
    void *environment;
    Log log;
    Update update;
    size_t required;
    struct state s;
} Model, *Instance;

static Status refuse(Instance m, String text)
{
    if (m && m->log && !IS(18))
        m->log(IS(35) ? m : m->environment, ERROR, IS(19) ? NULL : "logStatusError", text);
    return ERROR;
}

static void begin(struct state *s)
{
    memset(s, 0, sizeof *s);
    s->size = sizeof *s, s->check = 0x6d6f64656c33;
    s->x = 1, s->k = 1, s->next = PERIOD;
    s->a[0] = 1, s->a[1] = 2, s->a[2] = 3;
}

static double rate(const struct state *s) { return -s->k * (s->x - s->u); }

/* the exact solution over a step h, for an input that starts at u0 with this slope */
static void advance(struct state *s, double h, double slope)
{
    double e = exp(-s->k * h), u1 = s->u + slope * h;
    s->x = u1 - slope / s->k + e * (s->x - s->u + slope / s->k);
    s->u = u1;
    s->t += h;
}

static Instance make(String name, String token, bool exchange, bool events, bool early, size_t required, void *environment,
                     Log log, Update update)
{
    static bool made;
    Instance m;
    if (IS(36) && made) {
        if (log)
            log(environment, ERROR, "logStatusError", "a second instance");
        return NULL;
    }
    if (!name || !token || (strcmp(token, TOKEN) && !IS(1))) {
        if (log)
            log(environment, ERROR, "logStatusError", "another token");
        return NULL;
    }
    m = calloc(1, sizeof *m);
    m->exchange = exchange, m->events = events, m->early = early, m->required = required;
    m->environment = environment, m->log = log, m->update = update;
    begin(&m->s);
    made = true;
    return m;
}

String fmi3GetVersion(void) { return IS(20) ? "2.0" : "3.0"; }
Status fmi3SetDebugLogging(Instance m, bool on, size_t n, const String c[]) { (void)m, (void)on, (void)n, (void)c; return OK; }
Instance fmi3InstantiateModelExchange(String name, String token, String path, bool visible, bool logging, void *environment, Log log)
{
    (void)path, (void)visible, (void)logging;
    return make(name, token, true, true, false, 0, environment, log, NULL);
}
Instance fmi3InstantiateCoSimulation(String name, String token, String path, bool visible, bool logging, bool events, bool early,
                                     const uint32_t required[], size_t n, void *environment, Log log, Update update)
{
    (void)path, (void)visible, (void)logging, (void)required;
    return make(name, token, false, events, early, n, environment, log, update);
}
void *fmi3InstantiateScheduledExecution(void) { return NULL; }
void fmi3FreeInstance(Instance m) { free(m); }
Status fmi3EnterInitializationMode(Instance m, bool has, double tolerance, double start, bool stops, double stop)
{
    static int started;
    (void)has, (void)tolerance, (void)stops, (void)stop;
    m->s.mode = INITIALIZATION;
    if (IS(39)) /* no two runs are the same */
        m->s.x += 1e-6 * ++started;
    m->s.t = start, m->s.next = start + PERIOD;
    return OK;
}
Status fmi3ExitInitializationMode(Instance m)
{
    m->s.mode = m->exchange || m->events ? EVENT : STEP;
    m->s.below = m->s.x <= 0.5;
    return OK;
}
Status fmi3EnterEventMode(Instance m) { m->s.mode = EVENT; return OK; }
Status fmi3EnterStepMode(Instance m) { m->s.mode = STEP; return OK; }
Status fmi3Terminate(Instance m) { m->s.mode = TERMINATED; return OK; }
Status fmi3Reset(Instance m)
{
    double k = m->s.k, x = m->s.x;
    begin(&m->s);
    if (IS(2))
        m->s.k = k, m->s.x = x;
    return OK;
}

static double *real(Instance m, uint32_t vr)
{
    switch (vr) {
    case T: return &m->s.t;
    case X: return &m->s.x;
    case U: return &m->s.u;
    case K: return &m->s.k;
    default: return NULL;
    }
}

static double indicator(Instance m)
{
    double z = m->s.x - 0.5;
    if (IS(3) && m->s.n > 0)
        return 0;
    return z == 0 ? (m->s.below ? -1e-300 : 1e-300) : z;
}

Status fmi3GetFloat64(Instance m, const uint32_t vr[], size_t n, double y[], size_t values)
{
    size_t at = 0;
    for (size_t i = 0; i < n; i++) {
        size_t size = vr[i] == A ? 3 : 1;
        if (at + size > values && !IS(4))
            return refuse(m, "fewer values than the variables have");
        if (vr[i] == A)
            for (size_t j = 0; j < 3; j++)
                y[at + j] = m->s.a[IS(5) ? 2 - j : j];
        else if (vr[i] == DX)
            y[at] = rate(&m->s);
        else if (vr[i] == Y) /* with faults 37 and 38, not finite between two events */
            y[at] = IS(37) && m->s.n == 1 ? NAN : IS(38) && m->s.n == 1 ? INFINITY : 2 * m->s.x;
        else if (vr[i] == Z)
            y[at] = indicator(m);
        else if (real(m, vr[i]))
            y[at] = *real(m, vr[i]);
        else if (IS(6))
            y[at] = 0;
        else
            return refuse(m, "no Float64 has this value reference");
        at += size;
    }
    return OK;
}
Status fmi3SetFloat64(Instance m, const uint32_t vr[], size_t n, const double y[], size_t values)
{
    size_t at = 0;
    for (size_t i = 0; i < n; i++) {
        size_t size = vr[i] == A ? 3 : 1;
        if (at + size > values)
            return refuse(m, "fewer values than the variables have");
        if ((vr[i] == K || vr[i] == A) && m->s.mode > INITIALIZATION && !IS(7))
            return refuse(m, "a fixed parameter is set before initialization ends");
        if (vr[i] == A)
            memcpy(m->s.a, y + at, sizeof m->s.a);
        else if (vr[i] == X || vr[i] == U || vr[i] == K)
            *real(m, vr[i]) = y[at];
        else
            return refuse(m, "it cannot be set");
        at += size;
    }
    return OK;
}
Status fmi3GetInt32(Instance m, const uint32_t vr[], size_t n, int32_t y[], size_t values)
{
    (void)values;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != N && !IS(8))
            return refuse(m, "no Int32 has this value reference");
        y[i] = m->s.n;
    }
    return OK;
}
Status fmi3GetBoolean(Instance m, const uint32_t vr[], size_t n, uint8_t y[], size_t values)
{
    (void)values;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != ON)
            return refuse(m, "no Boolean has this value reference");
        y[i] = m->s.on ? (IS(9) ? 0xff : 1) : (IS(9) ? 2 : 0);
    }
    return OK;
}
Status fmi3SetBoolean(Instance m, const uint32_t vr[], size_t n, const uint8_t y[], size_t values)
{
    (void)values;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != ON)
            return refuse(m, "no Boolean has this value reference");
        m->s.on = y[i] != 0;
    }
    return OK;
}

Status fmi3GetFMUState(Instance m, void **state)
{
    if (!*state)
        *state = malloc(sizeof m->s);
    memcpy(*state, &m->s, sizeof m->s);
    return OK;
}
Status fmi3SetFMUState(Instance m, void *state)
{
    int32_t n = m->s.n;
    memcpy(&m->s, state, sizeof m->s);
    if (IS(10))
        m->s.n = n;
    return OK;
}
Status fmi3FreeFMUState(Instance m, void **state)
{
    (void)m;
    free(*state);
    *state = NULL;
    return OK;
}
Status fmi3SerializedFMUStateSize(Instance m, void *state, size_t *size) { (void)m, (void)state; *size = sizeof(struct state); return OK; }
Status fmi3SerializeFMUState(Instance m, void *state, uint8_t bytes[], size_t size)
{
    if (size < sizeof(struct state))
        return refuse(m, "too few bytes");
    memcpy(bytes, state, sizeof(struct state));
    return OK;
}
Status fmi3DeserializeFMUState(Instance m, const uint8_t bytes[], size_t size, void **state)
{
    if (size != sizeof(struct state) && !IS(11))
        return refuse(m, "these bytes are no state");
    if (!*state)
        *state = malloc(sizeof(struct state));
    begin(*state);
    memcpy(*state, bytes, size < sizeof(struct state) ? size : sizeof(struct state));
    return OK;
}

/* d(unknown)/d(known) */
static double partial(Instance m, uint32_t unknown, uint32_t known)
{
    if (unknown == DX)
        return known == X ? -m->s.k : known == U ? m->s.k : 0;
    if (unknown == Y)
        return known == X ? (IS(12) ? 1 : 2) : 0;
    return unknown == X && known == X;
}
Status fmi3GetDirectionalDerivative(Instance m, const uint32_t unknowns[], size_t n, const uint32_t knowns[], size_t p,
                                    const double seed[], size_t seeds, double y[], size_t values)
{
    (void)seeds, (void)values;
    for (size_t i = 0; i < n; i++) {
        y[i] = 0;
        for (size_t j = 0; j < p; j++)
            y[i] += partial(m, unknowns[i], knowns[j]) * seed[j];
    }
    return OK;
}
Status fmi3GetAdjointDerivative(Instance m, const uint32_t unknowns[], size_t n, const uint32_t knowns[], size_t p,
                                const double seed[], size_t seeds, double y[], size_t values)
{
    (void)seeds, (void)values;
    for (size_t j = 0; j < p; j++) {
        y[j] = 0;
        for (size_t i = 0; i < n; i++)
            y[j] += partial(m, unknowns[i], knowns[j]) * seed[i] * (IS(13) && knowns[j] == U ? 0 : 1);
    }
    return OK;
}
Status fmi3GetNumberOfVariableDependencies(Instance m, uint32_t vr, size_t *n)
{
    if (vr != Y && vr != N)
        return refuse(m, "its dependencies are not told");
    *n = 1;
    return OK;
}
Status fmi3GetVariableDependencies(Instance m, uint32_t vr, size_t own[], uint32_t of[], size_t other[], int kinds[], size_t n)
{
    if ((vr != Y && vr != N) || n != 1)
        return refuse(m, "its dependencies are not told");
    own[0] = 0, other[0] = 0, kinds[0] = 1, of[0] = IS(14) ? U : vr == Y ? X : T;
    return OK;
}
Status fmi3EnterConfigurationMode(Instance m) { return refuse(m, "there are no structural parameters"); }
Status fmi3ExitConfigurationMode(Instance m) { return refuse(m, "there are no structural parameters"); }

/* Returns true if the time of the next count has come, to rounding. */
static bool is_due(const struct state *s) { return s->t >= s->next - 1e-9; }

static void count(struct state *s)
{
    s->n++;
    s->next += PERIOD;
    s->due = false;
}
Status fmi3UpdateDiscreteStates(Instance m, bool *more, bool *end, bool *nominals, bool *values, bool *defined, double *next)
{
    if (is_due(&m->s) || m->s.due)
        count(&m->s);
    else if (IS(15))
        m->s.n++;
    m->s.below = m->s.x <= 0.5;
    *more = *end = *nominals = *values = false;
    *defined = true;
    *next = IS(16) ? m->s.t : m->s.next;
    return OK;
}
Status fmi3EnterContinuousTimeMode(Instance m) { m->s.mode = CONTINUOUS; return OK; }
Status fmi3CompletedIntegratorStep(Instance m, bool forget, bool *enter, bool *end) { (void)m, (void)forget; *enter = *end = false; return OK; }
Status fmi3SetTime(Instance m, double t) { m->s.t = t; return OK; }
Status fmi3SetContinuousStates(Instance m, const double x[], size_t n)
{
    (void)n;
    if (!IS(17))
        m->s.x = x[0];
    return OK;
}
Status fmi3GetContinuousStateDerivatives(Instance m, double dx[], size_t n) { (void)n; dx[0] = rate(&m->s); return OK; }
Status fmi3GetEventIndicators(Instance m, double z[], size_t n) { (void)n; z[0] = indicator(m); return OK; }
Status fmi3GetContinuousStates(Instance m, double x[], size_t n) { (void)n; x[0] = m->s.x; return OK; }
Status fmi3GetNominalsOfContinuousStates(Instance m, double x[], size_t n) { (void)m, (void)n; x[0] = 1; return OK; }
Status fmi3GetNumberOfEventIndicators(Instance m, size_t *n) { (void)m; *n = 1; return OK; }
Status fmi3GetNumberOfContinuousStates(Instance m, size_t *n) { (void)m; *n = IS(21) ? 2 : 1; return OK; }
Status fmi3GetOutputDerivatives(Instance m, const uint32_t vr[], size_t n, const int32_t order[], double y[], size_t values)
{
    (void)values;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != Y || order[i] != 1)
            return refuse(m, "only y has a derivative, of order 1");
        y[i] = 2 * rate(&m->s);
    }
    return OK;
}

Status fmi3DoStep(Instance m, double t, double h, bool forget, bool *event, bool *end, bool *early, double *last)
{
    double stop = t + h;
    (void)forget;
    if (!(h > 0) && !IS(22))
        return refuse(m, "a step is above 0");
    *event = *end = *early = IS(23);
    if (!IS(24))
        *last = t;
    while (m->s.t < stop - 1e-12) {
        struct state *s = &m->s;
        double to = stop;
        bool requested = false, wanted = false;
        double time;
        if (s->next < stop - 1e-9)
            to = s->next;
        if (to > stop - 1e-9)
            to = stop;
        time = to;
        if (m->update || IS(25)) {
            double u0 = s->u, piece = to - s->t;
            if (IS(26))
                time = s->t - 1;
            m->update(IS(35) ? m : m->environment, time, true, false, false, m->early, &requested, &time);
            double u1 = s->u;
            wanted = requested, requested = false;
            if (IS(27))
                u1 = u0;
            s->u = IS(28) ? u1 : u0;
            advance(s, piece, IS(28) ? 0 : (u1 - u0) / piece);
            s->u = u1;
            time = to;
            m->update(IS(35) ? m : m->environment, time, false, true, true, m->early, &requested, &time);
            wanted = wanted || requested;
        } else {
            advance(s, to - s->t, 0);
        }
        s->t = to;
        if (is_due(s)) {
            if (m->events && !IS(29)) {
                *event = true;
                s->due = true;
                if (m->early) {
                    *early = to < stop;
                    stop = to;
                } else {
                    s->next += PERIOD; /* counted at the end of the step */
                    s->next -= PERIOD;
                    advance(s, stop - s->t > 0 ? stop - s->t : 0, 0);
                    s->t = stop;
                }
            } else {
                count(s);
                if (IS(30) && m->early)
                    count(s);
            }
            if (IS(31))
                *event = true;
        }
        if (wanted && m->early && to < stop && !IS(32)) {
            *early = true;
            stop = to;
        }
        if (IS(33) && !m->early && !m->events && s->t < stop - 1e-9) {
            *early = true;
            stop = to;
        }
    }
    if (!IS(24))
        *last = IS(34) && *early ? t + h : stop;
    return OK;
}

/* the other functions that an FMU must export */
#define STUB(name) \
    Status name(Instance m) { return refuse(m, #name " is not supported"); }
STUB(fmi3GetFloat32) STUB(fmi3GetInt8) STUB(fmi3GetUInt8) STUB(fmi3GetInt16) STUB(fmi3GetUInt16) STUB(fmi3GetUInt32)
STUB(fmi3GetInt64) STUB(fmi3GetUInt64) STUB(fmi3GetString) STUB(fmi3GetBinary) STUB(fmi3GetClock)
STUB(fmi3SetFloat32) STUB(fmi3SetInt8) STUB(fmi3SetUInt8) STUB(fmi3SetInt16) STUB(fmi3SetUInt16) STUB(fmi3SetInt32)
STUB(fmi3SetUInt32) STUB(fmi3SetInt64) STUB(fmi3SetUInt64) STUB(fmi3SetString) STUB(fmi3SetBinary) STUB(fmi3SetClock)
STUB(fmi3GetIntervalDecimal) STUB(fmi3GetIntervalFraction) STUB(fmi3GetShiftDecimal) STUB(fmi3GetShiftFraction)
STUB(fmi3SetIntervalDecimal) STUB(fmi3SetIntervalFraction) STUB(fmi3SetShiftDecimal) STUB(fmi3SetShiftFraction)
STUB(fmi3EvaluateDiscreteStates) STUB(fmi3ActivateModelPartition)
