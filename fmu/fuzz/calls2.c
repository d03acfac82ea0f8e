/* Calls of all 44 functions of FMI 2.0 by the hostile host; see host.c. The official headers declare the functions. */
#include "choices.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String format, ...) {
    if (environment != nothing)
        fail("the logger got another environment");
    if (!name || !category || !format || strcmp(format, "%s"))
        fail("the logger got no name, no category or no plain format");
    va_list list;
    va_start(list, format);
    const char *message = va_arg(list, const char *);
    va_end(list);
    judge_message((int)status, category, message);
}

static void free_instance(int which) {
    begin("fmi2FreeInstance");
    fmi2FreeInstance(instances[which]);
    timed();
    instances[which] = NULL;
}

static void instantiate(void) {
    int which = slot();
    unsigned kind = byte();
    if (instances[which])
        free_instance(which);
    /* The struct is on the heap and is freed after the call, because the FMU must not use it later. */
    fmi2CallbackFunctions *callbacks = malloc(sizeof *callbacks);
    if (!callbacks)
        fail("no memory");
    fmi2CallbackFunctions full = {logger, calloc, free, NULL, nothing};
    fmi2CallbackFunctions none = {NULL, NULL, NULL, NULL, NULL};
    memcpy(callbacks, kind % 8 == 7 ? &none : &full, sizeof full);
    int well = kind < 224;
    fmi2Type type = well ? (kind % 2 ? fmi2CoSimulation : fmi2ModelExchange) : (fmi2Type)integer();
    const char *name = well ? "hostile" : text();
    const char *id = well || one_in(2) ? fmu->guid : text();
    const char *resources = one_in(2) ? text() : "file:///nowhere";
    int passes_callbacks = well || !one_in(4);
    begin("fmi2Instantiate");
    instances[which] = fmi2Instantiate(name, type, id, resources,
                                       passes_callbacks ? callbacks : NULL, one_in(2), one_in(2));
    timed();
    free(callbacks);
    if (well && !instances[which])
        fail("no instance");
}

/* Initialises an instance, so that not every input has to find this sequence of calls. */
static void initialise(void) {
    fmi2Component c = instance();
    CALL(fmi2SetupExperiment, c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    CALL(fmi2EnterInitializationMode, c);
    CALL(fmi2ExitInitializationMode, c);
}

static int read_reals(void *c, const unsigned *references, size_t n, double *values) {
    return CALL(fmi2GetReal, c, references, n, values);
}

static int do_step(fmi2Component c, double t, double h) {
    int status = CALL(fmi2DoStep, c, t, shortened(h), fmi2True);
    if (status == HOST_OK)
        check_outputs(0, read_reals, c);
    return status;
}

/* Returns the present communication point, or sometimes another time. */
static double time_of(fmi2Component c) {
    double t = 0.0;
    if (one_in(16) || CALL(fmi2GetRealStatus, c, fmi2LastSuccessfulTime, &t) != HOST_OK)
        return real();
    return t;
}

static void step(void) {
    fmi2Component c = instance();
    double t = time_of(c);
    double h = one_in(4) ? real() : 1e-3 * (1 + byte());
    do_step(c, t, h);
}

/* Returns the bytes of an instance's state, which the caller frees; NULL if the instance cannot save its state. */
static char *take(fmi2Component c, size_t *size) {
    fmi2FMUstate handle = NULL;
    if (CALL(fmi2GetFMUstate, c, &handle) != HOST_OK)
        return NULL;
    char *taken = NULL;
    if (CALL(fmi2SerializedFMUstateSize, c, handle, size) == HOST_OK) {
        taken = malloc(*size);
        if (!taken || CALL(fmi2SerializeFMUstate, c, handle, taken, *size) != HOST_OK)
            fail("a saved state gives no bytes");
    }
    if (CALL(fmi2FreeFMUstate, c, &handle) != HOST_OK || handle)
        fail("a saved state could not be freed");
    return taken;
}

/* Makes a step, restores the state before it and repeats the step: the saved states must have the same bytes. */
static void step_twice(void) {
    fmi2Component c = instance();
    fmi2FMUstate here = NULL;
    size_t size[2];
    char *after[2];
    if (CALL(fmi2GetFMUstate, c, &here) != HOST_OK)
        return;
    double t = time_of(c);
    double h = 1e-3 * (1 + byte());
    for (int i = 0; i < 2; i++) {
        do_step(c, t, h);
        after[i] = take(c, &size[i]);
        if (CALL(fmi2SetFMUstate, c, here) != HOST_OK)
            fail("the instance's own state was refused");
    }
    if (size[0] != size[1] || memcmp(after[0], after[1], size[0]))
        fail("the same step gave two different states");
    free(after[0]);
    free(after[1]);
    CALL(fmi2FreeFMUstate, c, &here);
}

static void serialise(void) {
    int which = slot();
    fmi2Component c = instance();
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
    fmi2Component c = instance();
    size_t size = saved[from].size;
    if (one_in(8))
        size -= size ? word() % size : 0;
    char *given = array(size, 1);
    if (given && size)
        memcpy(given, saved[from].bytes, size);
    if (given && size && one_in(4))
        given[word() % size] ^= (char)(1 << byte() % 8);
    fmi2FMUstate read = NULL;
    int status = CALL(fmi2DeSerializeFMUstate, c, given, size, one_in(24) ? NULL : &read);
    if (status != HOST_OK)
        return;
    CALL(fmi2FreeFMUstate, c, &states[into]);
    states[into] = read;
}

static void call(void) {
    size_t n, m;
    int flags[2];
    double time;
    fmi2EventInfo info;
    fmi2FMUstate *handle;
    fmi2Component c;
    unsigned which = byte() % 56;
    if (which >= 50) {
        step();
        return;
    }
    switch (which) {
    case 0: instantiate(); return;
    case 1: initialise(); return;
    case 2: step(); return;
    case 3: step_twice(); return;
    case 4: serialise(); return;
    case 5: deserialise(); return;
    case 6: free_instance(slot()); return;
    default: c = instance();
    }
    switch (which) {
    case 7:
        n = length();
        CALL(fmi2SetDebugLogging, c, integer(), n, texts(n));
        break;
    case 8: CALL(fmi2SetupExperiment, c, integer(), real(), real(), one_in(4), real()); break;
    case 9: CALL(fmi2EnterInitializationMode, c); break;
    case 10: CALL(fmi2ExitInitializationMode, c); break;
    case 11: CALL(fmi2Terminate, c); break;
    case 12: CALL(fmi2Reset, c); break;
    case 13:
        n = length();
        CALL(fmi2GetReal, c, references(n), n, reals(n));
        break;
    case 14:
        n = length();
        CALL(fmi2GetInteger, c, references(n), n, integers(n));
        break;
    case 15:
        n = length();
        CALL(fmi2GetBoolean, c, references(n), n, integers(n));
        break;
    case 16:
        n = length();
        CALL(fmi2GetString, c, references(n), n, texts(n));
        break;
    case 17: case 18: case 19:
        n = length();
        CALL(fmi2SetReal, c, references(n), n, reals(n));
        break;
    case 20: case 21:
        n = length();
        CALL(fmi2SetInteger, c, references(n), n, integers(n));
        break;
    case 22: case 23:
        n = length();
        CALL(fmi2SetBoolean, c, references(n), n, integers(n));
        break;
    case 24:
        n = length();
        CALL(fmi2SetString, c, references(n), n, texts(n));
        break;
    case 25: CALL(fmi2GetFMUstate, c, one_in(24) ? NULL : &states[slot()]); break;
    case 26: CALL(fmi2SetFMUstate, c, state()); break;
    case 27:
        handle = &states[slot()];
        if (*handle && one_in(8)) {
            /* passes the handle itself instead of its address, as fmusim does */
            if (CALL(fmi2FreeFMUstate, c, (fmi2FMUstate *)*handle) == HOST_OK)
                *handle = NULL;
            break;
        }
        CALL(fmi2FreeFMUstate, c, one_in(24) ? NULL : handle);
        break;
    case 28: CALL(fmi2SerializedFMUstateSize, c, state(), array(1, sizeof(size_t))); break;
    case 29:
        n = one_in(4) ? byte() : 1 << 14;
        CALL(fmi2SerializeFMUstate, c, state(), array(n, 1), n);
        break;
    case 30: case 31:
        n = length();
        m = length();
        CALL(fmi2GetDirectionalDerivative, c, references(n), n, references(m), m, reals(m), reals(n));
        break;
    case 32:
        n = length();
        CALL(fmi2SetRealInputDerivatives, c, references(n), n, integers(n), reals(n));
        break;
    case 33:
        n = length();
        CALL(fmi2GetRealOutputDerivatives, c, references(n), n, integers(n), reals(n));
        break;
    case 34: do_step(c, real(), real()); break;
    case 35: CALL(fmi2CancelStep, c); break;
    case 36: CALL(fmi2GetStatus, c, (fmi2StatusKind)integer(), array(1, sizeof(fmi2Status))); break;
    case 37: CALL(fmi2GetRealStatus, c, (fmi2StatusKind)integer(), reals(1)); break;
    case 38: CALL(fmi2GetIntegerStatus, c, (fmi2StatusKind)integer(), integers(1)); break;
    case 39: CALL(fmi2GetBooleanStatus, c, (fmi2StatusKind)integer(), integers(1)); break;
    case 40: CALL(fmi2GetStringStatus, c, (fmi2StatusKind)integer(), texts(1)); break;
    case 41: CALL(fmi2EnterEventMode, c); break;
    case 42: CALL(fmi2NewDiscreteStates, c, one_in(24) ? NULL : &info); break;
    case 43: CALL(fmi2EnterContinuousTimeMode, c); break;
    case 44:
        CALL(fmi2CompletedIntegratorStep, c, integer(), one_in(24) ? NULL : &flags[0],
             one_in(24) ? NULL : &flags[1]);
        break;
    case 45:
        time = real();
        CALL(fmi2SetTime, c, time);
        break;
    case 46:
        n = one_in(8) ? length() : fmu->states;
        CALL(fmi2SetContinuousStates, c, reals(n), n);
        break;
    case 47:
        n = one_in(8) ? length() : fmu->states;
        CALL(fmi2GetDerivatives, c, reals(n), n);
        break;
    case 48:
        n = one_in(8) ? length() : fmu->indicators;
        CALL(fmi2GetEventIndicators, c, reals(n), n);
        break;
    default:
        n = one_in(8) ? length() : fmu->states;
        CALL(fmi2GetContinuousStates, c, reals(n), n);
        CALL(fmi2GetNominalsOfContinuousStates, c, reals(n), n);
    }
}

static void start(void) {
    if (strcmp(fmi2GetVersion(), "2.0") || strcmp(fmi2GetTypesPlatform(), "default"))
        fail("version or platform");
    instantiate();
}

static void end(void) {
    if (!instances[0])
        instantiate();
    for (int i = 0; i < SLOTS; i++)
        if (CALL(fmi2FreeFMUstate, instances[0], &states[i]) != HOST_OK || states[i])
            fail("a saved state could not be freed");
    for (int i = 0; i < SLOTS; i++)
        free_instance(i);
}

const struct host_version host_fmi2 = {start, call, end};
