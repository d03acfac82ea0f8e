/* A hostile host in C: turns bytes into calls of all 44 functions of FMI 2.0, in any order,
 * with any arguments, NULL among them. One rule it keeps: memory is valid. Arrays are exactly
 * as long as it says (an address sanitizer or valgrind sees one element more), handles point
 * to something, nothing is used after it was freed.
 *
 * What must hold whatever it does: no crash, no fmi2Warning, fmi2Fatal or fmi2Pending, no call
 * that works longer than `host_slowest_allowed`, log messages that are text, finite outputs after
 * a step that succeeded, no division by zero, invalid operation or overflow in a call that succeeded
 * (some hosts trap these), and the same state after going back and stepping again.
 *
 * `src/calls.rs` gives it to a fuzzer, `replay.c` to a packed FMU. The functions' types are the
 * official headers'. */
#define _POSIX_C_SOURCE 200809L
#include "host.h"

#include <fenv.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"

/* Calls per input. */
#define CALLS 100
/* Simulated seconds per input in steps of more than one second: they are slow, not bad. */
#define LONG_STEPS 1
#define SLOTS 4
#define MAX_OUTPUTS 64
/* What a host may trap. */
#define EXCEPTIONS (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)
/* Numbers of such size are judged: products of ten of them do not overflow on the way to an answer. */
#define MODERATE(x) ((x) == 0.0 || (fabs(x) > 1e-30 && fabs(x) < 1e30))

/* For a fuzzer: under its sanitizer a call takes some ten times as long. replay.c is told its own. */
double host_slowest_allowed = 100.0;
struct host_report host_report;

static const struct host_fmu *fmu;
static const uint8_t *bytes;
static size_t left;
static const char *at = "start";
/* Whether other numbers are among the arguments of the call at hand; whether the FMU has taken any
 * since this input began. */
static int offers_extreme, has_extreme;
static int long_steps;

/* What the host has. */
static fmi2Component instances[SLOTS];
static fmi2FMUstate states[SLOTS];
static struct { char *bytes; size_t size; } saved[SLOTS];
static uint64_t nothing[8];
/* Arrays of the call at hand. */
static void *arrays[8];
static int arrays_count;

static void fail(const char *what) {
    fprintf(stderr, "%s: %s\n", at, what);
    abort();
}

/* ---- Choices ---- */

static unsigned byte(void) {
    if (!left)
        return 0;
    left--;
    return *bytes++;
}

static int one_in(unsigned n) { return byte() % n == n - 1; }

static uint64_t word(void) {
    uint64_t x = 0;
    for (int i = 0; i < 8; i++)
        x = x << 8 | byte();
    return x;
}

static double real(void) {
    static const double special[] = {0.0, -0.0, 1.0, -1.0, 0.01, 0.1, 0.5, 1e-3, 1e-9, 9.81, 1e3,
                                     1e9, 1e300, -1e300, 5e-324, 1.7976931348623157e308};
    unsigned kind = byte();
    double y;
    if (kind < 32) {
        y = special[kind % 16];
    } else if (kind < 36) {
        y = kind % 2 ? NAN : kind % 4 ? INFINITY : -INFINITY;
    } else if (kind < 60) {
        uint64_t x = word();
        memcpy(&y, &x, sizeof y);
    } else { /* something of everyday size */
        y = ((int)byte() - 128) * pow(10.0, (int)(kind % 8) - 6);
    }
    offers_extreme |= !MODERATE(y);
    return y;
}

static int integer(void) {
    unsigned kind = byte();
    return kind < 200 ? (int)(kind % 13) - 1 : (int)word();
}

static fmi2ValueReference reference(void) {
    unsigned kind = byte();
    if (kind < 4)
        return (fmi2ValueReference)word();
    return kind < 60 ? kind % 30 : (kind << 8 | byte()) % (fmu->variables + 8);
}

static size_t length(void) {
    const size_t special[] = {0, 1, 1, 1, 2, 3, fmu->indicators, fmu->states};
    return special[byte() % 8];
}

static const char *text(void) {
    static const char *special[] = {"", "one", " ", "%s%n%d", "logEvents", "logAll", "logStatusError",
                                    "\xff\xfe", "a\nb", "logStatusDiscard"};
    unsigned kind = byte();
    if (kind == 255)
        return NULL;
    return special[kind % 10];
}

/* ---- Arguments ---- */

/* n elements that the next `done` frees; sometimes NULL. */
static void *array(size_t n, size_t size) {
    if (one_in(24))
        return NULL;
    size_t room = n > 0 ? n * size : 1;
    void *memory = malloc(room);
    if (!memory)
        fail("no memory");
    arrays[arrays_count++] = memory;
    memset(memory, 0x7f, room);
    return memory;
}

static double *reals(size_t n) {
    double *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = real();
    return x;
}

static int *integers(size_t n) {
    int *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = integer();
    return x;
}

static fmi2ValueReference *references(size_t n) {
    fmi2ValueReference *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = reference();
    return x;
}

static const char **texts(size_t n) {
    const char **x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = text();
    return x;
}

/* Mostly the first, so that something comes of it. */
static int slot(void) {
    unsigned kind = byte();
    return kind < 160 ? 0 : (int)(kind % SLOTS);
}

static fmi2Component instance(void) {
    unsigned kind = byte();
    switch (kind) {
    case 255: return NULL;
    case 254: return nothing;
    case 253: return (char *)nothing + 1;
    case 252: return states[0];
    default: return instances[kind < 160 ? 0 : kind % SLOTS];
    }
}

static fmi2FMUstate state(void) {
    unsigned kind = byte();
    switch (kind) {
    case 255: return NULL;
    case 254: return nothing;
    case 253: return (char *)nothing + 1;
    case 252: return instances[0];
    default: return states[kind < 160 ? 0 : kind % SLOTS];
    }
}

/* ---- Calls ---- */

static struct timespec begun;

static void begin(const char *name) {
    at = name;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begun);
    feclearexcept(EXCEPTIONS);
}

static void timed(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    double seconds = (double)(now.tv_sec - begun.tv_sec) + 1e-9 * (double)(now.tv_nsec - begun.tv_nsec);
    host_report.calls++;
    if (seconds > host_report.slowest) {
        host_report.slowest = seconds;
        host_report.slowest_call = at;
    }
    if (seconds > host_slowest_allowed)
        fail("took too long");
}

static fmi2Status done(fmi2Status status) {
    int raised = fetestexcept(EXCEPTIONS);
    timed();
    if (status != fmi2OK && status != fmi2Discard && status != fmi2Error)
        fail("returned neither fmi2OK nor fmi2Discard nor fmi2Error");
    has_extreme |= offers_extreme && status == fmi2OK;
    offers_extreme = 0;
    if (status == fmi2OK && raised && !has_extreme)
        fail("raised a floating-point exception, which a host may trap");
    if (status == fmi2OK)
        host_report.accepted++;
    while (arrays_count)
        free(arrays[--arrays_count]);
    return status;
}

/* Arguments are chosen before the clock starts. */
#define CALL(name, ...) (begin(#name), done(name(__VA_ARGS__)))

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
    if (!message || !*message)
        fail("the logger got no message");
    if (status == fmi2Fatal) {
        fprintf(stderr, "%s\n", message);
        fail("the FMU panicked");
    }
    if (strncmp(category, "log", 3))
        fail("the logger got a category that is none");
    host_report.messages++;
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
    /* on the heap, and gone after the call, as is all the FMU was given */
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

/* To where the model moves, so that not all inputs have to find the way. */
static void initialise(void) {
    fmi2Component c = instance();
    CALL(fmi2SetupExperiment, c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    CALL(fmi2EnterInitializationMode, c);
    CALL(fmi2ExitInitializationMode, c);
}

/* After a step that succeeded every output is a number. */
static void check_outputs(fmi2Component c) {
    fmi2ValueReference all[MAX_OUTPUTS];
    double values[MAX_OUTPUTS];
    if (fmu->outputs > MAX_OUTPUTS)
        fail("has more outputs than MAX_OUTPUTS");
    for (unsigned i = 0; i < fmu->outputs; i++)
        all[i] = i;
    if (CALL(fmi2GetReal, c, all, fmu->outputs, values) != fmi2OK)
        fail("no outputs after a step that succeeded");
    for (unsigned i = 0; i < fmu->outputs; i++) {
        if (!isfinite(values[i])) {
            fprintf(stderr, "output %u is %g\n", i, values[i]);
            fail("outputs are no numbers after a step that succeeded");
        }
    }
}

static fmi2Status do_step(fmi2Component c, double t, double h) {
    /* Long steps are bounded by the model's number of steps; one is enough for a while. */
    if (h > 1.0 && isfinite(h) && long_steps++ >= LONG_STEPS)
        h = 1.0;
    fmi2Status status = CALL(fmi2DoStep, c, t, h, fmi2True);
    if (status == fmi2OK)
        check_outputs(c);
    return status;
}

/* The communication point, or something else. */
static double time_of(fmi2Component c) {
    double t = 0.0;
    if (one_in(16) || CALL(fmi2GetRealStatus, c, fmi2LastSuccessfulTime, &t) != fmi2OK)
        return real();
    return t;
}

static void step(void) {
    fmi2Component c = instance();
    double t = time_of(c);
    double h = one_in(4) ? real() : 1e-3 * (1 + byte());
    do_step(c, t, h);
}

/* The bytes of an instance's state; NULL if it gives none. Freed by the caller. */
static char *take(fmi2Component c, size_t *size) {
    fmi2FMUstate handle = NULL;
    if (CALL(fmi2GetFMUstate, c, &handle) != fmi2OK)
        return NULL;
    char *taken = NULL;
    if (CALL(fmi2SerializedFMUstateSize, c, handle, size) == fmi2OK) {
        taken = malloc(*size);
        if (!taken || CALL(fmi2SerializeFMUstate, c, handle, taken, *size) != fmi2OK)
            fail("a saved state gives no bytes");
    }
    if (CALL(fmi2FreeFMUstate, c, &handle) != fmi2OK || handle)
        fail("a saved state could not be freed");
    return taken;
}

/* Back and again: the same bytes. */
static void step_twice(void) {
    fmi2Component c = instance();
    fmi2FMUstate here = NULL;
    size_t size[2];
    char *after[2];
    if (CALL(fmi2GetFMUstate, c, &here) != fmi2OK)
        return;
    double t = time_of(c);
    double h = 1e-3 * (1 + byte());
    for (int i = 0; i < 2; i++) {
        do_step(c, t, h);
        after[i] = take(c, &size[i]);
        if (CALL(fmi2SetFMUstate, c, here) != fmi2OK)
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
    fmi2Status status = CALL(fmi2DeSerializeFMUstate, c, given, size, one_in(24) ? NULL : &read);
    if (status != fmi2OK)
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
            /* by itself in place of its address, as fmusim does; the host forgets it if it is gone */
            if (CALL(fmi2FreeFMUstate, c, (fmi2FMUstate *)*handle) == fmi2OK)
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

void host_run(const struct host_fmu *the_fmu, const uint8_t *data, size_t size) {
    fmu = the_fmu;
    bytes = data;
    left = size;
    long_steps = offers_extreme = has_extreme = 0;
    if (strcmp(fmi2GetVersion(), "2.0") || strcmp(fmi2GetTypesPlatform(), "default"))
        fail("version or platform");
    instantiate();
    for (int n = 0; n < CALLS && left; n++)
        call();
    /* Saved states are an instance's to free. */
    left = 0;
    if (!instances[0])
        instantiate();
    for (int i = 0; i < SLOTS; i++) {
        if (CALL(fmi2FreeFMUstate, instances[0], &states[i]) != fmi2OK || states[i])
            fail("a saved state could not be freed");
        free(saved[i].bytes);
        saved[i].bytes = NULL;
        saved[i].size = 0;
    }
    for (int i = 0; i < SLOTS; i++)
        free_instance(i);
    host_report.inputs++;
}
