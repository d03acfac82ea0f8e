/* A small FMU without a fault, for the tests of `hubslosh check`: x' = -k (x - u), solved exactly in
 * Co-Simulation. Compiled with -DRATE=… for k, -DCO_SIMULATION, -DMODEL_EXCHANGE or both, and -DBLOWS_UP
 * for x' = k x^2, which has no solution after t = 1/(k x(0)). Further definitions give it one fault or one habit each:
 * STALE        x is the value before the last step
 * DELAY        x is its value of 0.25 s earlier
 * UNIT_DELAY   x is the input of the last step but one
 * EULER        steps of Euler's method
 * CRASHES      every step crashes
 * NO_CATEGORY  messages have the category NULL
 * RESOURCES    k is read from resources/rate.txt
 * RAW_LOCATION, NEEDS_AUTHORITY, TRUSTS: in the location of the resources, %20 is not decoded; only URIs with file:/// are
 *              accepted; NULL crashes
 * UNKNOWN      an unknown value reference crashes
 * SILENT       no messages
 * GIVES_UP     no steps after an error
 * NOISE        no two runs are the same
 * FORGETS      a state that is set changes nothing
 * SINGULAR     no initialisation with another k than the declared one
 * ONCE         one instance in each process
 * MOVED        steps with another k than the declared one crash
 * MANY=n       n further variables: every tenth is a parameter, the others are multiples of x (harness/studies/large_fmu.py) */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

enum mode { INSTANTIATED, INITIALIZATION, STEPPING, EVENT, CONTINUOUS, TERMINATED };
enum { X, DER_X, K, U, OWN };

#ifndef MANY
#define MANY 0
#endif
#define COUNT (OWN + MANY)

#define MAGIC 0x6d6f64656c2e6331

/* The part of the model that fmi2GetFMUstate saves. */
struct state {
    unsigned long long magic;
    enum mode mode;
    int setup;
    double t, stop, x, k, u;
    double shown, held; /* values of x and u that the host sees */
    double parameters[MANY / 10 + 1];
    unsigned long long check; /* checksum of the fields above, with which damaged states are refused */
};

typedef struct {
    int type;
    char name[100];
    int gave_up; /* a call was refused */
    struct callbacks host;
    struct state s;
} Model, *Component;

#ifdef NO_CATEGORY
#define CATEGORY NULL
#else
#define CATEGORY "logStatusError"
#endif

static Status refuse(Component m, String call, String why)
{
    if (m)
        m->gave_up = 1;
#ifdef SILENT
    (void)m, (void)call, (void)why;
    return ERROR;
#endif
    if (m && m->host.logger)
        m->host.logger(m->host.environment, m->name, ERROR, CATEGORY, "%s: %s", call, why);
    return ERROR;
}

#define ALLOW(condition, call)                                      \
    do {                                                            \
        if (!m)                                                     \
            return ERROR;                                           \
        if (!(condition))                                           \
            return refuse(m, call, "it is not allowed now");        \
    } while (0)

static double rate(const struct state *s)
{
#ifdef BLOWS_UP
    return s->k * s->x * s->x;
#else
    return -s->k * (s->x - s->u);
#endif
}

static double value(const struct state *s, unsigned reference)
{
    switch (reference) {
    case X:
        return s->shown;
    case DER_X:
        return rate(s);
    case K:
        return s->k;
    case U:
        return s->u;
    default:
        reference -= OWN;
        return reference % 10 ? reference * s->shown : s->parameters[reference / 10];
    }
}

/* Returns the address of a value that a host may set now, or NULL if it may not. */
static double *place(struct state *s, unsigned reference)
{
    int early = s->mode == INSTANTIATED || s->mode == INITIALIZATION;
    if (reference == U)
        return s->mode != TERMINATED ? &s->u : NULL;
    if (!early || reference >= COUNT || reference == DER_X)
        return NULL;
    if (reference < OWN)
        return reference == K ? &s->k : &s->x;
    reference -= OWN;
    return reference % 10 ? NULL : &s->parameters[reference / 10];
}

static void begin(struct state *s)
{
    memset(s, 0, sizeof *s);
    s->magic = MAGIC;
    s->stop = INFINITY;
    s->x = s->shown = 1;
    s->k = RATE;
}

#ifdef RESOURCES
/* Reads rate.txt from the folder of a URI. Returns 0 if there is no such file. */
static double rate_at(const char *uri)
{
    char path[4096];
    double rate = 0;
    size_t n = 0;
    FILE *file;
#ifdef NEEDS_AUTHORITY
    if (strncmp(uri, "file://", 7) != 0)
        return 0;
#endif
    uri += strlen("file:");
    if (strncmp(uri, "//", 2) == 0)
        uri += 2;
    for (; *uri && n + strlen("/rate.txt") + 1 < sizeof path; uri++) {
        unsigned code;
        path[n] = *uri;
#ifndef RAW_LOCATION
        if (*uri == '%' && sscanf(uri + 1, "%2x", &code) == 1) {
            path[n] = (char)code;
            uri += 2;
        }
#else
        (void)code;
#endif
        n++;
    }
    memcpy(path + n, "/rate.txt", sizeof "/rate.txt");
    file = fopen(path, "r");
    if (!file)
        return 0;
    if (fscanf(file, "%lf", &rate) != 1)
        rate = 0;
    fclose(file);
    return rate;
}
#endif

String fmi2GetTypesPlatform(void) { return "default"; }
String fmi2GetVersion(void) { return "2.0"; }

static int is_text(const char *text) { return text && *text; }

Component fmi2Instantiate(String name, int type, String guid, String resources,
                          const struct callbacks *host, int visible, int logging)
{
#ifdef ONCE
    static int made;
#endif
    Component m;
    String why = NULL;
    (void)resources, (void)visible, (void)logging;
    if (!is_text(name))
        why = "no instance name";
    else if (!guid || strcmp(guid, "{model}") != 0)
        why = "another GUID";
#ifdef ONCE
    else if (made)
        why = "a second instance";
#endif
#ifndef CO_SIMULATION
    else if (type == 1)
        why = "no Co-Simulation";
#endif
#ifndef MODEL_EXCHANGE
    else if (type == 0)
        why = "no Model Exchange";
#endif
#ifdef RESOURCES
#ifdef TRUSTS
    else if (rate_at(resources) == 0)
#else
    else if (!resources || rate_at(resources) == 0)
#endif
        why = "rate.txt cannot be read";
#endif
    m = why ? NULL : calloc(1, sizeof *m);
    if (!m) {
        if (host && host->logger)
            host->logger(host->environment, name ? name : "", ERROR, CATEGORY, "%s",
                         why ? why : "no memory");
        return NULL;
    }
#ifdef ONCE
    made = 1;
#endif
    m->type = type;
    snprintf(m->name, sizeof m->name, "%s", name);
    if (host)
        m->host = *host;
    begin(&m->s);
#ifdef RESOURCES
    m->s.k = rate_at(resources);
#endif
    return m;
}

void fmi2FreeInstance(Component m) { free(m); }

Status fmi2SetDebugLogging(Component m, int on, size_t n, const String *categories)
{
    (void)on, (void)n, (void)categories;
    return m ? OK : ERROR;
}

Status fmi2SetupExperiment(Component m, int tolerant, double tolerance, double start, int stops,
                           double stop)
{
    (void)tolerant, (void)tolerance;
    ALLOW(m->s.mode == INSTANTIATED, "fmi2SetupExperiment");
    m->s.setup = 1;
    m->s.t = start;
    m->s.stop = stops ? stop : INFINITY;
    return OK;
}

Status fmi2EnterInitializationMode(Component m)
{
    ALLOW(m->s.mode == INSTANTIATED && m->s.setup, "fmi2EnterInitializationMode");
#ifdef SINGULAR
    if (m->s.k != RATE)
        return refuse(m, "fmi2EnterInitializationMode", "there is no solution");
#endif
    m->s.mode = INITIALIZATION;
    return OK;
}

Status fmi2ExitInitializationMode(Component m)
{
    ALLOW(m->s.mode == INITIALIZATION, "fmi2ExitInitializationMode");
    m->s.mode = m->type == 0 ? EVENT : STEPPING;
    return OK;
}

Status fmi2Terminate(Component m)
{
    ALLOW(m->s.mode >= STEPPING && m->s.mode != TERMINATED, "fmi2Terminate");
    m->s.mode = TERMINATED;
    return OK;
}

Status fmi2Reset(Component m)
{
    if (!m)
        return ERROR;
    begin(&m->s);
    return OK;
}

Status fmi2GetReal(Component m, const unsigned *r, size_t n, double *x)
{
    size_t i;
    ALLOW(m->s.mode != INSTANTIATED, "fmi2GetReal");
    for (i = 0; i < n; i++)
        if (r[i] >= COUNT)
#ifdef UNKNOWN
            abort();
#else
            return refuse(m, "fmi2GetReal", "an unknown value reference");
#endif
    for (i = 0; i < n; i++)
        x[i] = value(&m->s, r[i]);
    return OK;
}

Status fmi2SetReal(Component m, const unsigned *r, size_t n, const double *x)
{
    size_t i;
    if (!m)
        return ERROR;
    for (i = 0; i < n; i++) {
        if (!place(&m->s, r[i]))
            return refuse(m, "fmi2SetReal", "it cannot be set now");
        if (!isfinite(x[i]) || (r[i] == K && x[i] < 0))
            return refuse(m, "fmi2SetReal", "a value outside its range");
    }
    for (i = 0; i < n; i++)
        *place(&m->s, r[i]) = x[i];
    if (m->s.mode == INSTANTIATED || m->s.mode == INITIALIZATION)
        m->s.shown = m->s.x;
    return OK;
}

/* The model has no variables of the other types. */
#define NOTHING(name, type)                                                     \
    Status name(Component m, const unsigned *r, size_t n, type *x)              \
    {                                                                           \
        (void)r, (void)x;                                                       \
        if (!m)                                                                 \
            return ERROR;                                                       \
        return n ? refuse(m, #name, "an unknown value reference") : OK;         \
    }
NOTHING(fmi2GetInteger, int)
NOTHING(fmi2GetBoolean, int)
NOTHING(fmi2GetString, String)
NOTHING(fmi2SetInteger, const int)
NOTHING(fmi2SetBoolean, const int)
NOTHING(fmi2SetString, const String)

/* FNV-1a */
static unsigned long long sum(const struct state *s)
{
    unsigned long long hash = 0xcbf29ce484222325;
    const unsigned char *bytes = (const unsigned char *)s;
    size_t i;
    for (i = 0; i < offsetof(struct state, check); i++)
        hash = (hash ^ bytes[i]) * 0x100000001b3;
    return hash;
}

Status fmi2GetFMUstate(Component m, void **state)
{
    if (!m || !state)
        return ERROR;
    if (!*state)
        *state = malloc(sizeof(struct state));
    m->s.check = sum(&m->s);
    memcpy(*state, &m->s, sizeof m->s);
    return OK;
}
Status fmi2SetFMUstate(Component m, void *state)
{
    if (!m)
        return ERROR;
    if (!state)
        return refuse(m, "fmi2SetFMUstate", "no state");
#ifndef FORGETS
    memcpy(&m->s, state, sizeof m->s);
#endif
    return OK;
}
Status fmi2FreeFMUstate(Component m, void **state)
{
    if (!m)
        return ERROR;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return OK;
}
Status fmi2SerializedFMUstateSize(Component m, void *state, size_t *size)
{
    if (!m || !state)
        return ERROR;
    *size = sizeof(struct state);
    return OK;
}
Status fmi2SerializeFMUstate(Component m, void *state, char *bytes, size_t size)
{
    if (!m || !state || size < sizeof(struct state))
        return ERROR;
    memcpy(bytes, state, sizeof(struct state));
    return OK;
}
Status fmi2DeSerializeFMUstate(Component m, const char *bytes, size_t size, void **state)
{
    struct state read;
    if (!m || !state)
        return ERROR;
    if (size != sizeof read)
        return refuse(m, "fmi2DeSerializeFMUstate", "not a state of this FMU");
    memcpy(&read, bytes, size);
    if (read.magic != MAGIC || read.check != sum(&read))
        return refuse(m, "fmi2DeSerializeFMUstate", "not a state of this FMU");
    if (!*state)
        *state = malloc(size);
    memcpy(*state, &read, size);
    return OK;
}
Status fmi2GetDirectionalDerivative(Component m, const unsigned *unknown, size_t n,
                                    const unsigned *known, size_t k, const double *along, double *x)
{
    (void)unknown, (void)n, (void)known, (void)k, (void)along, (void)x;
    return refuse(m, "fmi2GetDirectionalDerivative", "it is not provided");
}

#ifdef CO_SIMULATION
Status fmi2SetRealInputDerivatives(Component m, const unsigned *r, size_t n, const int *order,
                                   const double *x)
{
    (void)r, (void)n, (void)order, (void)x;
    return refuse(m, "fmi2SetRealInputDerivatives", "inputs are not interpolated");
}
Status fmi2GetRealOutputDerivatives(Component m, const unsigned *r, size_t n, const int *order,
                                    double *x)
{
    (void)r, (void)n, (void)order, (void)x;
    return refuse(m, "fmi2GetRealOutputDerivatives", "they are not provided");
}
Status fmi2DoStep(Component m, double t, double h, int forget)
{
    (void)forget;
    ALLOW(m->s.mode == STEPPING, "fmi2DoStep");
    if (!(h > 0 && isfinite(h)))
        return refuse(m, "fmi2DoStep", "the step must be finite and above 0");
    if (!(fabs(t - m->s.t) <= 1e-9 * (fabs(t) + h)))
        return refuse(m, "fmi2DoStep", "the last step ended elsewhere");
    if (t + h > m->s.stop + 1e-9 * (fabs(t) + h))
        return refuse(m, "fmi2DoStep", "it leads past the stop time");
#ifdef CRASHES
    abort();
#endif
#ifdef GIVES_UP
    if (m->gave_up)
        return ERROR;
#endif
#ifdef MOVED
    if (m->s.k != RATE)
        abort();
#endif
#ifdef NOISE
    static double noise;
    m->s.x += noise += 1e-6;
#endif
#ifdef STALE
    m->s.shown = m->s.x;
#endif
#ifdef EULER
    m->s.x += h * rate(&m->s);
#else
    m->s.x = m->s.u + (m->s.x - m->s.u) * exp(-m->s.k * h);
#endif
    m->s.t = t + h;
#ifdef DELAY
    m->s.shown = m->s.t < 0.25 ? 1 : exp(-m->s.k * (m->s.t - 0.25));
#elif defined UNIT_DELAY
    m->s.shown = m->s.held;
    m->s.held = m->s.u;
#elif !defined STALE
    m->s.shown = m->s.x;
#endif
    return OK;
}
Status fmi2CancelStep(Component m) { return refuse(m, "fmi2CancelStep", "no step is pending"); }
#define STATUS(name, type)                                                \
    Status name(Component m, int kind, type *x)                           \
    {                                                                     \
        (void)kind, (void)x;                                              \
        return refuse(m, #name, "no step is pending");                    \
    }
STATUS(fmi2GetStatus, Status)
STATUS(fmi2GetRealStatus, double)
STATUS(fmi2GetIntegerStatus, int)
STATUS(fmi2GetBooleanStatus, int)
STATUS(fmi2GetStringStatus, String)
#endif

#ifdef MODEL_EXCHANGE
Status fmi2EnterEventMode(Component m)
{
    ALLOW(m->s.mode == CONTINUOUS, "fmi2EnterEventMode");
    m->s.mode = EVENT;
    return OK;
}
Status fmi2NewDiscreteStates(Component m, struct event_info *info)
{
    ALLOW(m->s.mode == EVENT, "fmi2NewDiscreteStates");
    memset(info, 0, sizeof *info);
    return OK;
}
Status fmi2EnterContinuousTimeMode(Component m)
{
    ALLOW(m->s.mode == EVENT, "fmi2EnterContinuousTimeMode");
    m->s.mode = CONTINUOUS;
    return OK;
}
Status fmi2CompletedIntegratorStep(Component m, int forget, int *enter, int *terminate)
{
    (void)forget;
    ALLOW(m->s.mode == CONTINUOUS, "fmi2CompletedIntegratorStep");
    *enter = *terminate = 0;
    return OK;
}
Status fmi2SetTime(Component m, double t)
{
    ALLOW(m->s.mode == EVENT || m->s.mode == CONTINUOUS, "fmi2SetTime");
    m->s.t = t;
    return OK;
}
Status fmi2SetContinuousStates(Component m, const double *x, size_t n)
{
    ALLOW(m->s.mode == CONTINUOUS && n == 1, "fmi2SetContinuousStates");
    m->s.x = m->s.shown = x[0];
    return OK;
}
Status fmi2GetDerivatives(Component m, double *x, size_t n)
{
    ALLOW(m->s.mode != INSTANTIATED && n == 1, "fmi2GetDerivatives");
    x[0] = rate(&m->s);
    return OK;
}
Status fmi2GetEventIndicators(Component m, double *x, size_t n)
{
    (void)x;
    ALLOW(m->s.mode != INSTANTIATED && n == 0, "fmi2GetEventIndicators");
    return OK;
}
Status fmi2GetContinuousStates(Component m, double *x, size_t n)
{
    ALLOW(m->s.mode != INSTANTIATED && n == 1, "fmi2GetContinuousStates");
    x[0] = m->s.x;
    return OK;
}
Status fmi2GetNominalsOfContinuousStates(Component m, double *x, size_t n)
{
    ALLOW(m->s.mode != INSTANTIATED && n == 1, "fmi2GetNominalsOfContinuousStates");
    x[0] = 1;
    return OK;
}
#endif

#ifdef UNDEFINED
/* This function is not defined anywhere, so that the library cannot be loaded. The library also exports 1,000 functions of C++. */
extern void UNDEFINED(void);
void (*const undefined)(void) = UNDEFINED;
#define ONE(n) void _ZN9pythonfmu4m##n##Ev(void) {}
#define TEN(n) ONE(n##0) ONE(n##1) ONE(n##2) ONE(n##3) ONE(n##4) ONE(n##5) ONE(n##6) ONE(n##7) ONE(n##8) ONE(n##9)
#define HUNDRED(n) TEN(n##0) TEN(n##1) TEN(n##2) TEN(n##3) TEN(n##4) TEN(n##5) TEN(n##6) TEN(n##7) TEN(n##8) TEN(n##9)
HUNDRED(0) HUNDRED(1) HUNDRED(2) HUNDRED(3) HUNDRED(4) HUNDRED(5) HUNDRED(6) HUNDRED(7) HUNDRED(8) HUNDRED(9)
#endif
