/* FMI 2.0 and FMI 3.0 for the C hosts of this folder: the same functions for both versions. -DFMI=2 or -DFMI=3 selects
 * the version. The types are those of the official headers.
 *
 * In Co-Simulation of FMI 3.0 the host handles events if `events_by_host` is set before an instance is made: a step
 * returns early and is then continued to its end. Inputs change linearly by intermediate update. */
#ifndef _GNU_SOURCE
#error "_GNU_SOURCE must be defined before anything is included"
#endif
#include <dlfcn.h>
#include <fenv.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#if FMI == 2
#include "fmi2Functions.h"
#else
#include "fmi3Functions.h"
#endif

typedef void *Instance;
typedef void *State;
typedef unsigned int Reference;
/* The status codes of both versions, which are equal. */
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;
enum { MODEL_EXCHANGE, CO_SIMULATION, KINDS };

/* GUID or instantiationToken. */
static const char *identity;
static void *library;
/* number of messages of the FMU, and number of those that explain why a call did not succeed */
static unsigned long messages, reasons;
/* true if messages are printed */
static int shows_messages;

/* Ends the process because of a fault of the FMU. */
static void fail(const char *what)
{
    fprintf(stderr, "error: %s\n", what);
    _exit(2);
}

/* Converts an address of data to an address of a function, which POSIX allows. */
static inline void *find(const char *name)
{
    void *function = dlsym(library, name);
    if (!function)
        fail(name);
    return function;
}
#define CALL(name) ((name##TYPE *)find(#name))
#define MUST(call)                        \
    do {                                  \
        if ((call) != OK)                 \
            fail(#call " is not OK");     \
    } while (0)

static inline void said(int status, const char *message)
{
    messages++;
    reasons += status >= DISCARD;
    if (shows_messages)
        fprintf(stderr, "%s\n", message);
}

#if FMI == 2

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String format, ...)
{
    char text[4000];
    va_list list;
    (void)environment, (void)name, (void)category;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    said(status, text);
}

static inline Instance instantiate(int kind)
{
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    fmi2Type type = kind == CO_SIMULATION ? fmi2CoSimulation : fmi2ModelExchange;
    return CALL(fmi2Instantiate)("host", type, identity, "file:///nowhere", &callbacks, 0, 1);
}

/* Initialises an instance until steps or events can follow. A tolerance or a stop time of 0 is not passed. */
static inline Status initialise(Instance c, int kind, double tolerance, double stop)
{
    Status status = (Status)CALL(fmi2SetupExperiment)(c, tolerance > 0, tolerance, 0, stop > 0, stop);
    (void)kind;
    if (status == OK)
        status = (Status)CALL(fmi2EnterInitializationMode)(c);
    return status == OK ? (Status)CALL(fmi2ExitInitializationMode)(c) : status;
}

static inline Status get_reals(Instance c, const Reference *r, size_t n, double *x)
{
    return (Status)CALL(fmi2GetReal)(c, r, n, x);
}

/* Reads integers (I), enumerations (E) or Booleans (B). */
static inline Status read_others(Instance c, char type, const Reference *r, size_t n)
{
    int *values = malloc((n + 1) * sizeof *values);
    Status status = (Status)(type == 'B' ? CALL(fmi2GetBoolean)(c, r, n, values) : CALL(fmi2GetInteger)(c, r, n, values));
    free(values);
    return status;
}

/* Sets a variable. The types are those of `read_others`, and R for a Real. */
static inline Status set_value(Instance c, char type, Reference r, double value)
{
    int integer = type == 'R' ? 0 : (int)value;
    if (type == 'R')
        return (Status)CALL(fmi2SetReal)(c, &r, 1, &value);
    return (Status)(type == 'B' ? CALL(fmi2SetBoolean)(c, &r, 1, &integer) : CALL(fmi2SetInteger)(c, &r, 1, &integer));
}

/* Makes an input change with this slope from now on, until the next step is done. */
static inline Status ramp(Instance c, Reference r, double at, double slope)
{
    const int order = 1;
    (void)at;
    return (Status)CALL(fmi2SetRealInputDerivatives)(c, &r, 1, &order, &slope);
}

static inline Status do_step(Instance c, double t, double h)
{
    return (Status)CALL(fmi2DoStep)(c, t, h, fmi2True);
}

static inline Status output_derivative(Instance c, Reference r, double *slope)
{
    const int order = 1;
    return (Status)CALL(fmi2GetRealOutputDerivatives)(c, &r, 1, &order, slope);
}

static inline Status derivative(Instance c, Reference unknown, Reference known, double *answer)
{
    const double one = 1;
    return (Status)CALL(fmi2GetDirectionalDerivative)(c, &unknown, 1, &known, 1, &one, answer);
}

static inline Status update_discrete_states(Instance c, int *again)
{
    fmi2EventInfo info;
    Status status = (Status)CALL(fmi2NewDiscreteStates)(c, &info);
    *again = status == OK && info.newDiscreteStatesNeeded;
    return status;
}

static inline Status completed_step(Instance c, int *event)
{
    fmi2Boolean enter = 0, end = 0;
    Status status = (Status)CALL(fmi2CompletedIntegratorStep)(c, fmi2True, &enter, &end);
    *event = enter;
    return status;
}

#define THE_SAME(name, of_2, of_3, parameters, arguments) \
    static inline Status name parameters { return (Status)CALL(of_2) arguments; }

#else

/* true if the host handles events within a step */
static int events_by_host;
static struct {
    Instance instance;
    Reference input;
    double at, value, slope;
    int active;
    Status set;
} line;
static unsigned long early_returns;

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)category;
    said((int)status, message);
}

/* Returns the value on the line. The sums of the host itself are not trapped. */
static double on_the_line(double t)
{
    int traps = fegetexcept();
    double value;
    fedisableexcept(FE_ALL_EXCEPT);
    value = line.value + line.slope * (t - line.at);
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(traps);
    return value;
}

static void intermediate_update(fmi3InstanceEnvironment environment, fmi3Float64 t, fmi3Boolean set_requested,
                                fmi3Boolean get_allowed, fmi3Boolean step_finished, fmi3Boolean can_return_early,
                                fmi3Boolean *early_return_requested, fmi3Float64 *early_return_time)
{
    (void)environment, (void)step_finished, (void)can_return_early;
    if (*early_return_requested || *early_return_time != t)
        fail("what an intermediate update answers is not set before");
    if (set_requested == get_allowed)
        fail("an intermediate update is for setting or for getting");
    if (set_requested && line.active) {
        double end = on_the_line(t);
        line.set = (Status)CALL(fmi3SetFloat64)(line.instance, &line.input, 1, &end, 1);
    }
}

/* the inputs that the host of an instance may change linearly within a step */
static Reference movable[100];
static size_t movable_count;

static inline Instance instantiate(int kind)
{
    if (kind == MODEL_EXCHANGE)
        return CALL(fmi3InstantiateModelExchange)("host", identity, NULL, 0, 1, NULL, logger);
    return CALL(fmi3InstantiateCoSimulation)("host", identity, NULL, 0, 1, events_by_host, events_by_host, movable,
                                             movable_count, NULL, logger, movable_count ? intermediate_update : NULL);
}

static inline Status update_discrete_states(Instance c, int *again)
{
    fmi3Boolean need = 0, end = 1, nominals = 1, values = 1, defined = 1;
    double next = NAN;
    Status status = (Status)CALL(fmi3UpdateDiscreteStates)(c, &need, &end, &nominals, &values, &defined, &next);
    if (status == OK && (end || nominals || isnan(next)))
        fail("an event ends the simulation, changes nominal values, or leaves an answer out");
    *again = status == OK && need;
    return status;
}

/* Goes through event mode to step mode. */
static inline Status to_step_mode(Instance c)
{
    int again;
    Status status;
    do
        status = update_discrete_states(c, &again);
    while (again);
    return status == OK ? (Status)CALL(fmi3EnterStepMode)(c) : status;
}

static inline Status initialise(Instance c, int kind, double tolerance, double stop)
{
    Status status = (Status)CALL(fmi3EnterInitializationMode)(c, tolerance > 0, tolerance, 0, stop > 0, stop);
    if (status == OK)
        status = (Status)CALL(fmi3ExitInitializationMode)(c);
    return status == OK && kind == CO_SIMULATION && events_by_host ? to_step_mode(c) : status;
}

static inline Status get_reals(Instance c, const Reference *r, size_t n, double *x)
{
    return (Status)CALL(fmi3GetFloat64)(c, r, n, x, n);
}

static inline Status read_others(Instance c, char type, const Reference *r, size_t n)
{
    void *values = malloc((n + 1) * sizeof(fmi3Int64));
    Status status = (Status)(type == 'B'   ? CALL(fmi3GetBoolean)(c, r, n, values, n)
                             : type == 'E' ? CALL(fmi3GetInt64)(c, r, n, values, n)
                                           : CALL(fmi3GetInt32)(c, r, n, values, n));
    free(values);
    return status;
}

static inline Status set_value(Instance c, char type, Reference r, double value)
{
    fmi3Int64 item = type == 'R' ? 0 : (fmi3Int64)value;
    fmi3Int32 integer = (fmi3Int32)item;
    fmi3Boolean flag = item != 0;
    switch (type) {
    case 'R': return (Status)CALL(fmi3SetFloat64)(c, &r, 1, &value, 1);
    case 'E': return (Status)CALL(fmi3SetInt64)(c, &r, 1, &item, 1);
    case 'B': return (Status)CALL(fmi3SetBoolean)(c, &r, 1, &flag, 1);
    default: return (Status)CALL(fmi3SetInt32)(c, &r, 1, &integer, 1);
    }
}

static inline Status ramp(Instance c, Reference r, double at, double slope)
{
    double value;
    Status status = get_reals(c, &r, 1, &value);
    if (status != OK)
        return status;
    line.instance = c, line.input = r, line.at = at, line.value = value, line.slope = slope;
    line.active = 1, line.set = OK;
    return OK;
}

static inline Status do_step(Instance c, double t, double h)
{
    const double end = t + h;
    Status status;
    if (line.instance != c)
        line.active = 0;
    for (int n = 0;; n++) {
        fmi3Boolean event = 1, over = 1, early = 1;
        double last = NAN;
        status = (Status)CALL(fmi3DoStep)(c, t, h, fmi3True, &event, &over, &early, &last);
        if (status == OK && line.active)
            status = line.set;
        if (status != OK)
            break;
        if (over || ((event || early) && !events_by_host) || (early && !event))
            fail("a step told what it must not");
        if (!(early ? last >= t && last <= end : last == end))
            fail("a step ended elsewhere");
        if (event) {
            status = (Status)CALL(fmi3EnterEventMode)(c);
            if (status == OK)
                status = to_step_mode(c);
        }
        early_returns += early;
        if (status != OK || !early)
            break;
        if (n > 100000)
            fail("a step returns early for ever");
        t = last;
        h = end - t;
        if (!(h > 0))
            break;
    }
    line.active = 0;
    return status;
}

static inline Status output_derivative(Instance c, Reference r, double *slope)
{
    const int order = 1;
    return (Status)CALL(fmi3GetOutputDerivatives)(c, &r, 1, &order, slope, 1);
}

/* Asks for the directional and the adjoint derivative, which must be the same number. */
static inline Status derivative(Instance c, Reference unknown, Reference known, double *answer)
{
    const double one = 1;
    double adjoint;
    Status status = (Status)CALL(fmi3GetDirectionalDerivative)(c, &unknown, 1, &known, 1, &one, 1, answer, 1);
    if (status != OK)
        return status;
    status = (Status)CALL(fmi3GetAdjointDerivative)(c, &unknown, 1, &known, 1, &one, 1, &adjoint, 1);
    if (status == OK && adjoint != *answer)
        fail("adjoint and directional derivative differ");
    return status;
}

static inline Status completed_step(Instance c, int *event)
{
    fmi3Boolean enter = 0, end = 1;
    Status status = (Status)CALL(fmi3CompletedIntegratorStep)(c, fmi3True, &enter, &end);
    if (status == OK && end)
        fail("a step ends the simulation");
    *event = enter;
    return status;
}

#define THE_SAME(name, of_2, of_3, parameters, arguments) \
    static inline Status name parameters { return (Status)CALL(of_3) arguments; }

#endif

THE_SAME(enter_event_mode, fmi2EnterEventMode, fmi3EnterEventMode, (Instance c), (c))
THE_SAME(enter_continuous_time, fmi2EnterContinuousTimeMode, fmi3EnterContinuousTimeMode, (Instance c), (c))
THE_SAME(set_time, fmi2SetTime, fmi3SetTime, (Instance c, double t), (c, t))
THE_SAME(get_states, fmi2GetContinuousStates, fmi3GetContinuousStates, (Instance c, double *x, size_t n), (c, x, n))
THE_SAME(set_states, fmi2SetContinuousStates, fmi3SetContinuousStates, (Instance c, const double *x, size_t n), (c, x, n))
THE_SAME(get_rates, fmi2GetDerivatives, fmi3GetContinuousStateDerivatives, (Instance c, double *x, size_t n), (c, x, n))
THE_SAME(get_indicators, fmi2GetEventIndicators, fmi3GetEventIndicators, (Instance c, double *z, size_t n), (c, z, n))
THE_SAME(terminate, fmi2Terminate, fmi3Terminate, (Instance c), (c))
THE_SAME(reset, fmi2Reset, fmi3Reset, (Instance c), (c))
THE_SAME(log_everything, fmi2SetDebugLogging, fmi3SetDebugLogging, (Instance c), (c, 1, 0, NULL))
THE_SAME(save, fmi2GetFMUstate, fmi3GetFMUState, (Instance c, State *s), (c, s))
THE_SAME(restore, fmi2SetFMUstate, fmi3SetFMUState, (Instance c, State s), (c, s))
THE_SAME(free_state, fmi2FreeFMUstate, fmi3FreeFMUState, (Instance c, State *s), (c, s))
THE_SAME(state_size, fmi2SerializedFMUstateSize, fmi3SerializedFMUStateSize, (Instance c, State s, size_t *n), (c, s, n))
THE_SAME(serialise, fmi2SerializeFMUstate, fmi3SerializeFMUState, (Instance c, State s, void *b, size_t n), (c, s, b, n))
THE_SAME(deserialise, fmi2DeSerializeFMUstate, fmi3DeserializeFMUState, (Instance c, const void *b, size_t n, State *s), (c, b, n, s))

/* Goes through event mode to continuous-time mode (Model Exchange). */
static inline Status to_continuous_time(Instance c)
{
    int again;
    Status status;
    do
        status = update_discrete_states(c, &again);
    while (again);
    return status == OK ? enter_continuous_time(c) : status;
}

static inline void free_instance(Instance c)
{
#if FMI == 2
    CALL(fmi2FreeInstance)(c);
#else
    CALL(fmi3FreeInstance)(c);
#endif
}
