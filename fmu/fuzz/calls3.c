/* Calls of all 75 functions of FMI 3.0 by the hostile host; see host.c. The official headers declare the functions.
 *
 * In addition to the rules of every version, a step must return early or report events only if the host has allowed this, and
 * must end at the time that it returns. Within a step, in intermediate updates, the host calls any function that does not free
 * the instance. An error terminates an instance; usually the host then resets and initialises it. */
#include "choices.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

/* Arguments with which each instance was created: Co-Simulation, event mode, early return. */
static struct {
    int steps, events, early;
} made[SLOTS];
/* True within a step; true if the host makes no calls within steps. */
static int within, quiet;

static int slot_of(void *c) {
    for (int i = 0; i < SLOTS; i++)
        if (c && instances[i] == c)
            return i;
    return -1;
}

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    if (environment != nothing)
        fail("the logger got another environment");
    judge_message((int)status, category, message);
}

static void free_instance(int which) {
    begin("fmi3FreeInstance");
    fmi3FreeInstance(instances[which]);
    timed();
    instances[which] = NULL;
}

static int has_arrays(void) { return fmu->outputs == 0; }

/* Returns a number of values for n references: usually n, and for arrays n times a possible number of elements. */
static size_t values_of(size_t n) {
    static const size_t elements[] = {1, 1, 3, 3, 3, 4, 9, 12};
    if (has_arrays())
        n *= elements[byte() % 8];
    return one_in(12) ? length() : n;
}

static fmi3Boolean *booleans(size_t n) {
    unsigned char *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = (unsigned char)byte(); /* 0 is false, any other byte is true */
    return (fmi3Boolean *)x;
}

static fmi3Int64 *items(size_t n) {
    fmi3Int64 *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = integer();
    return x;
}

static void some_values(void *c) {
    size_t n = length(), m = values_of(n);
    switch (byte() % 10) {
    case 0: CALL(fmi3GetFloat64, c, references(n), n, reals(m), m); break;
    case 1: CALL(fmi3GetInt32, c, references(n), n, integers(m), m); break;
    case 2: CALL(fmi3GetInt64, c, references(n), n, items(m), m); break;
    case 3: CALL(fmi3GetBoolean, c, references(n), n, booleans(m), m); break;
    case 4: CALL(fmi3SetInt32, c, references(n), n, integers(m), m); break;
    case 5: CALL(fmi3SetInt64, c, references(n), n, items(m), m); break;
    case 6: CALL(fmi3SetBoolean, c, references(n), n, booleans(m), m); break;
    default: CALL(fmi3SetFloat64, c, references(n), n, reals(m), m);
    }
}

/* Calls a function for a type that no variable has, or for clocks. */
static void values_of_no_variable(void *c) {
    size_t n = one_in(2) ? 0 : length(), m = values_of(n);
#define VALUES(type) (type *)array(m, sizeof(type))
    switch (byte() % 30) {
    case 0: CALL(fmi3GetFloat32, c, references(n), n, VALUES(fmi3Float32), m); break;
    case 1: CALL(fmi3GetInt8, c, references(n), n, VALUES(fmi3Int8), m); break;
    case 2: CALL(fmi3GetUInt8, c, references(n), n, VALUES(fmi3UInt8), m); break;
    case 3: CALL(fmi3GetInt16, c, references(n), n, VALUES(fmi3Int16), m); break;
    case 4: CALL(fmi3GetUInt16, c, references(n), n, VALUES(fmi3UInt16), m); break;
    case 5: CALL(fmi3GetUInt32, c, references(n), n, VALUES(fmi3UInt32), m); break;
    case 6: CALL(fmi3GetUInt64, c, references(n), n, VALUES(fmi3UInt64), m); break;
    case 7: CALL(fmi3GetString, c, references(n), n, texts(m), m); break;
    case 8: CALL(fmi3GetBinary, c, references(n), n, VALUES(size_t), VALUES(fmi3Binary), m); break;
    case 9: CALL(fmi3SetFloat32, c, references(n), n, VALUES(fmi3Float32), m); break;
    case 10: CALL(fmi3SetInt8, c, references(n), n, VALUES(fmi3Int8), m); break;
    case 11: CALL(fmi3SetUInt8, c, references(n), n, VALUES(fmi3UInt8), m); break;
    case 12: CALL(fmi3SetInt16, c, references(n), n, VALUES(fmi3Int16), m); break;
    case 13: CALL(fmi3SetUInt16, c, references(n), n, VALUES(fmi3UInt16), m); break;
    case 14: CALL(fmi3SetUInt32, c, references(n), n, VALUES(fmi3UInt32), m); break;
    case 15: CALL(fmi3SetUInt64, c, references(n), n, VALUES(fmi3UInt64), m); break;
    case 16: CALL(fmi3SetString, c, references(n), n, texts(m), m); break;
    case 17: CALL(fmi3SetBinary, c, references(n), n, VALUES(size_t), VALUES(fmi3Binary), m); break;
    case 18: CALL(fmi3GetClock, c, references(n), n, (fmi3Clock *)booleans(n)); break;
    case 19: CALL(fmi3SetClock, c, references(n), n, (fmi3Clock *)array(n, sizeof(fmi3Clock))); break;
    case 20: CALL(fmi3GetIntervalDecimal, c, references(n), n, reals(n), array(n, sizeof(int))); break;
    case 21: CALL(fmi3GetIntervalFraction, c, references(n), n, array(n, 8), array(n, 8), array(n, sizeof(int))); break;
    case 22: CALL(fmi3GetShiftDecimal, c, references(n), n, reals(n)); break;
    case 23: CALL(fmi3GetShiftFraction, c, references(n), n, array(n, 8), array(n, 8)); break;
    case 24: CALL(fmi3SetIntervalDecimal, c, references(n), n, reals(n)); break;
    case 25: CALL(fmi3SetIntervalFraction, c, references(n), n, array(n, 8), array(n, 8)); break;
    case 26: CALL(fmi3SetShiftDecimal, c, references(n), n, reals(n)); break;
    case 27: CALL(fmi3SetShiftFraction, c, references(n), n, array(n, 8), array(n, 8)); break;
    case 28: CALL(fmi3ActivateModelPartition, c, (unsigned)integer(), real()); break;
    default:
        begin("fmi3InstantiateScheduledExecution");
        if (fmi3InstantiateScheduledExecution("hostile", fmu->token, NULL, false, false, nothing, logger, NULL, NULL, NULL))
            fail("there is no Scheduled Execution");
        timed();
    }
}

/* Updates the discrete states, sometimes with a NULL argument. */
static void update_discrete_states(void *c) {
    fmi3Boolean flags[5];
    double next = 0.0;
    int which = one_in(24) ? (int)(byte() % 6) : 6;
    int status = CALL(fmi3UpdateDiscreteStates, c, which == 0 ? NULL : &flags[0], which == 1 ? NULL : &flags[1],
                      which == 2 ? NULL : &flags[2], which == 3 ? NULL : &flags[3], which == 4 ? NULL : &flags[4],
                      which == 5 ? NULL : &next);
    if (status == HOST_OK && (flags[0] || flags[1] || flags[2]))
        fail("the FMU requests another update, the end, or other nominal values");
}

static void handle_event(void *c) {
    update_discrete_states(c);
    CALL(fmi3EnterStepMode, c);
}

/* Initialises an instance up to a state in which most calls are allowed, so that not every input has to find this sequence. */
static void initialise(void *c) {
    int which = slot_of(c);
    int defined = one_in(2);
    CALL(fmi3EnterInitializationMode, c, defined, defined ? 1e-6 : NAN, 0.0, false, NAN);
    if (CALL(fmi3ExitInitializationMode, c) != HOST_OK || which < 0)
        return;
    if (!made[which].steps) {
        update_discrete_states(c);
        CALL(fmi3EnterContinuousTimeMode, c);
    } else if (made[which].events) {
        handle_event(c);
    }
}

/* Intermediate update: within a step the host makes any calls and returns any answer. */
static void intermediate_update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean set_requested,
                                fmi3Boolean get_allowed, fmi3Boolean step_finished, fmi3Boolean can_return_early,
                                fmi3Boolean *early_return_requested, fmi3Float64 *early_return_time) {
    if (environment != nothing || set_requested == get_allowed || step_finished != get_allowed)
        fail("an intermediate update has a wrong environment or inconsistent flags");
    if (*early_return_requested || *early_return_time != time)
        fail("the answers of an intermediate update have no values");
    if (within || quiet)
        return;
    struct host_call outer = suspend();
    within = 1;
    for (unsigned n = byte() % 4; n > 0; n--) {
        void *c = instance();
        fmi3Boolean flag;
        double room;
        size_t m = length();
        void *taken = NULL;
        switch (byte() % 16) {
        case 0: CALL(fmi3Reset, c); break;
        case 1: CALL(fmi3Terminate, c); break;
        case 2: CALL(fmi3SetFMUState, c, state()); break;
        case 3:
            if (CALL(fmi3GetFMUState, c, &taken) == HOST_OK)
                CALL(fmi3FreeFMUState, c, &taken);
            break;
        case 4: CALL(fmi3DoStep, c, time, 1e-3, false, &flag, &flag, &flag, &room); break;
        case 5: CALL(fmi3EnterEventMode, c); break;
        case 6: CALL(fmi3SetDebugLogging, c, one_in(2), 0, NULL); break;
        case 7: update_discrete_states(c); break;
        case 8: case 9: CALL(fmi3GetOutputDerivatives, c, references(m), m, integers(m), reals(m), m); break;
        default: some_values(c);
        }
    }
    if (can_return_early ? one_in(4) : one_in(16)) {
        *early_return_requested = true;
        *early_return_time = one_in(3) ? real() : time - 1e-3 * byte();
    }
    within = 0;
    resume(outer);
}

static void instantiate(void) {
    int which = slot();
    unsigned kind = byte(), looks_in = byte();
    if (instances[which])
        free_instance(which);
    int well = kind < 224;
    const char *name = well ? "hostile" : text();
    const char *token = well || one_in(2) ? fmu->token : text();
    const char *resources = one_in(2) ? text() : NULL;
    fmi3LogMessageCallback log = kind % 8 == 7 ? NULL : logger;
    made[which].steps = kind % 4 != 0;
    made[which].events = one_in(2), made[which].early = one_in(2);
    if (!made[which].steps) {
        begin("fmi3InstantiateModelExchange");
        instances[which] = fmi3InstantiateModelExchange(name, token, resources, one_in(2), one_in(2), nothing, log);
        timed();
    } else {
        /* The required variables are an output and an input; other variables would be refused. */
        size_t n = well ? 0 : length();
        unsigned some[2] = {1 + looks_in % 4, (unsigned)(fmu->inputs + (has_arrays() ? 0 : looks_in % 3))};
        unsigned *required = well ? some : references(n);
        begin("fmi3InstantiateCoSimulation");
        instances[which] = fmi3InstantiateCoSimulation(
            name, token, resources, one_in(2), one_in(2), made[which].events, made[which].early, required,
            well ? 2 : n, nothing, log, looks_in % 2 ? intermediate_update : NULL);
        timed();
    }
    if (well && !instances[which])
        fail("no instance");
}

static int read_reals(void *c, const unsigned *references, size_t n, double *values) {
    return CALL(fmi3GetFloat64, c, references, n, values, n);
}

static int do_step(void *c, double t, double h) {
    fmi3Boolean event = true, over = true, early = true;
    double last = NAN;
    int which = slot_of(c), missing = one_in(48) ? (int)(byte() % 4) : 4;
    h = shortened(h);
    int status = CALL(fmi3DoStep, c, t, h, one_in(2), missing == 0 ? NULL : &event, missing == 1 ? NULL : &over,
                      missing == 2 ? NULL : &early, missing == 3 ? NULL : &last);
    if (which >= 0 && missing == 4) {
        if (status == HOST_OK && (over || (event && !made[which].events) || (early && !made[which].early)))
            fail("the step reports an event or an early return that the host has not allowed");
        if (isnan(last) || (status == HOST_OK && !early && last != t + h))
            fail("the step has not ended at the time that it returned");
    }
    if (status != HOST_OK)
        return status;
    check_outputs(1, read_reals, c);
    if (event && missing == 4 && !one_in(4)) {
        CALL(fmi3EnterEventMode, c);
        handle_event(c);
    }
    return status;
}

/* Returns the present communication point, or sometimes another time. */
static double time_of(void *c) {
    double t = 0.0;
    unsigned time = (unsigned)fmu->variables + 1;
    if (one_in(16) || CALL(fmi3GetFloat64, c, &time, 1, &t, 1) != HOST_OK)
        return real();
    return t;
}

static void step(void) {
    void *c = instance();
    double t = time_of(c);
    double h = one_in(4) ? real() : 1e-3 * (1 + byte());
    do_step(c, t, h);
}

/* Returns the bytes of an instance's state, which the caller frees; NULL if the instance cannot save its state. */
static char *take(void *c, size_t *size) {
    void *handle = NULL;
    if (CALL(fmi3GetFMUState, c, &handle) != HOST_OK)
        return NULL;
    char *taken = NULL;
    if (CALL(fmi3SerializedFMUStateSize, c, handle, size) == HOST_OK) {
        taken = malloc(*size);
        if (!taken || CALL(fmi3SerializeFMUState, c, handle, (fmi3Byte *)taken, *size) != HOST_OK)
            fail("a saved state gives no bytes");
    }
    if (CALL(fmi3FreeFMUState, c, &handle) != HOST_OK || handle)
        fail("a saved state could not be freed");
    return taken;
}

/* Makes a step, restores the state before it and repeats the step: the saved states must have the same bytes. The host makes no
 * calls within these steps. */
static void step_twice(void) {
    void *c = instance(), *here = NULL;
    size_t size[2];
    char *after[2];
    fmi3Boolean event, over, early;
    double last, t = time_of(c), h = 1e-3 * (1 + byte());
    if (CALL(fmi3GetFMUState, c, &here) != HOST_OK)
        return;
    quiet = 1;
    for (int i = 0; i < 2; i++) {
        CALL(fmi3DoStep, c, t, h, true, &event, &over, &early, &last);
        after[i] = take(c, &size[i]);
        if (CALL(fmi3SetFMUState, c, here) != HOST_OK)
            fail("the instance's own state was refused");
    }
    quiet = 0;
    if (!after[0] || !after[1] || size[0] != size[1] || memcmp(after[0], after[1], size[0]))
        fail("the same step gave two different states");
    free(after[0]);
    free(after[1]);
    CALL(fmi3FreeFMUState, c, &here);
}

static void serialise(void) {
    int which = slot();
    void *c = instance();
    size_t size;
    char *taken = take(c, &size);
    if (!taken)
        return;
    free(saved[which].bytes);
    saved[which].bytes = taken;
    saved[which].size = size;
}

static void deserialise(void) {
    int from = slot(), into = slot();
    void *c = instance();
    size_t size = saved[from].size;
    if (one_in(8))
        size -= size ? word() % size : 0;
    char *given = array(size, 1);
    if (given && size)
        memcpy(given, saved[from].bytes, size);
    if (given && size && one_in(4))
        given[word() % size] ^= (char)(1 << byte() % 8);
    void *read = NULL;
    if (CALL(fmi3DeserializeFMUState, c, (fmi3Byte *)given, size, one_in(24) ? NULL : &read) != HOST_OK)
        return;
    CALL(fmi3FreeFMUState, c, &states[into]);
    states[into] = read;
}

static void dependencies(void *c) {
    unsigned *of = references(1);
    unsigned unknown = of ? *of : 0;
    size_t n = 0;
    if (CALL(fmi3GetNumberOfVariableDependencies, c, unknown, one_in(24) ? NULL : &n) != HOST_OK)
        return;
    if (one_in(8))
        n = length();
    CALL(fmi3GetVariableDependencies, c, unknown, array(n, sizeof(size_t)), array(n, sizeof(unsigned)),
         array(n, sizeof(size_t)), array(n, sizeof(fmi3DependencyKind)), n);
}

static void call_of(unsigned which, void *c) {
    size_t n, m, many;
    fmi3Boolean flags[2];
    void **handle;
    switch (which) {
    case 7: n = length(); CALL(fmi3SetDebugLogging, c, one_in(2), n, texts(n)); break;
    case 8: CALL(fmi3EnterInitializationMode, c, one_in(2), real(), real(), one_in(4), real()); break;
    case 9: CALL(fmi3ExitInitializationMode, c); break;
    case 10: CALL(fmi3Terminate, c); break;
    case 11: CALL(fmi3Reset, c); break;
    case 12: CALL(fmi3EnterConfigurationMode, c); break;
    case 13: CALL(fmi3ExitConfigurationMode, c); break;
    case 14: CALL(fmi3EvaluateDiscreteStates, c); break;
    case 15: dependencies(c); break;
    case 16: CALL(fmi3GetNumberOfEventIndicators, c, array(1, sizeof(size_t))); break;
    case 17: CALL(fmi3GetNumberOfContinuousStates, c, array(1, sizeof(size_t))); break;
    case 18: values_of_no_variable(c); break;
    case 25: CALL(fmi3GetFMUState, c, one_in(24) ? NULL : &states[slot()]); break;
    case 26: CALL(fmi3SetFMUState, c, state()); break;
    case 27:
        handle = &states[slot()];
        if (*handle && one_in(8)) {
            /* passes the handle itself instead of its address, as fmusim does */
            if (CALL(fmi3FreeFMUState, c, (void **)*handle) == HOST_OK)
                *handle = NULL;
            break;
        }
        CALL(fmi3FreeFMUState, c, one_in(24) ? NULL : handle);
        break;
    case 28: CALL(fmi3SerializedFMUStateSize, c, state(), array(1, sizeof(size_t))); break;
    case 29:
        n = one_in(4) ? byte() : 1 << 14;
        CALL(fmi3SerializeFMUState, c, state(), array(n, 1), n);
        break;
    case 30: case 31:
        n = length(), m = length(), many = values_of(m);
        CALL(fmi3GetDirectionalDerivative, c, references(n), n, references(m), m, reals(many), many, reals(n), n);
        break;
    case 32: case 33:
        n = length(), m = length(), many = values_of(m);
        CALL(fmi3GetAdjointDerivative, c, references(n), n, references(m), m, reals(n), n, reals(many), many);
        break;
    case 34: do_step(c, real(), real()); break;
    case 35:
        n = length(), m = values_of(n);
        CALL(fmi3GetOutputDerivatives, c, references(n), n, integers(n), reals(m), m);
        break;
    case 41: CALL(fmi3EnterEventMode, c); break;
    case 42: update_discrete_states(c); break;
    case 43: CALL(fmi3EnterContinuousTimeMode, c); break;
    case 44:
        CALL(fmi3CompletedIntegratorStep, c, one_in(2), one_in(24) ? NULL : &flags[0], one_in(24) ? NULL : &flags[1]);
        break;
    case 45: CALL(fmi3SetTime, c, real()); break;
    case 46: n = one_in(8) ? length() : fmu->states; CALL(fmi3SetContinuousStates, c, reals(n), n); break;
    case 47: n = one_in(8) ? length() : fmu->states; CALL(fmi3GetContinuousStateDerivatives, c, reals(n), n); break;
    case 48: n = one_in(8) ? length() : fmu->indicators; CALL(fmi3GetEventIndicators, c, reals(n), n); break;
    case 49:
        n = one_in(8) ? length() : fmu->states;
        CALL(fmi3GetContinuousStates, c, reals(n), n);
        CALL(fmi3GetNominalsOfContinuousStates, c, reals(n), n);
        break;
    case 50: CALL(fmi3EnterStepMode, c); break;
    default: some_values(c);
    }
}

/* After an error, usually resets and initialises the instance. */
static void begin_again(void *c) {
    if (slot_of(c) < 0 || one_in(4))
        return;
    CALL(fmi3Reset, c);
    initialise(c);
}

static void call(void) {
    unsigned which = byte() % 58;
    void *c;
    if (which >= 51) {
        step();
        return;
    }
    switch (which) {
    case 0: instantiate(); return;
    case 1: initialise(instance()); return;
    case 2: step(); return;
    case 3: step_twice(); return;
    case 4: serialise(); return;
    case 5: deserialise(); return;
    case 6: free_instance(slot()); return;
    default: c = instance();
    }
    unsigned long errors = host_report.errors;
    call_of(which, c);
    if (host_report.errors != errors)
        begin_again(c);
}

static void start(void) {
    if (strcmp(fmi3GetVersion(), "3.0"))
        fail("version");
    instantiate();
}

static void end(void) {
    if (!instances[0])
        instantiate();
    for (int i = 0; i < SLOTS; i++)
        if (CALL(fmi3FreeFMUState, instances[0], &states[i]) != HOST_OK || states[i])
            fail("a saved state could not be freed");
    for (int i = 0; i < SLOTS; i++)
        free_instance(i);
}

const struct host_version host_fmi3 = {start, call, end};
