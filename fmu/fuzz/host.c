/* A hostile host in C. It turns bytes into calls of all functions of FMI 2.0 (calls2.c) or 3.0 (calls3.c), in any order and with
 * any arguments, also NULL. The first byte determines the version. The host obeys only one rule: memory is valid. Arrays have
 * exactly the length that it passes (so that an address sanitizer or valgrind detects an access to one element more), handles
 * point to memory, and nothing is used after it was freed.
 *
 * Whatever the calls are, there must be no crash, no status except OK, Discard and Error, and no call that takes longer than
 * `host_slowest_allowed`. Log messages must be text, outputs must be finite after a successful step, and a successful call must
 * not divide by zero, overflow or make an invalid operation, because some hosts trap these. If the host restores a state and
 * repeats a step, the result must be the same.
 *
 * `src/calls.rs` links this host with a fuzzer, and `replay.c` with a packed FMU. */
#define _POSIX_C_SOURCE 200809L
#include "choices.h"

#include <fenv.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Number of steps of more than one second per input. They are allowed, but slow. */
#define LONG_STEPS 1
/* Floating-point exceptions that a host may trap. */
#define EXCEPTIONS (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)
/* True for arguments with which a call must not raise exceptions: products of ten such numbers do not overflow. */
#define MODERATE(x) ((x) == 0.0 || (fabs(x) > 1e-30 && fabs(x) < 1e30))

/* Value for a fuzzer, under whose sanitizer a call takes about ten times as long. replay.c sets its own value. */
double host_slowest_allowed = 100.0;
struct host_report host_report;

const struct host_fmu *fmu;
static unsigned references_end;
static const uint8_t *bytes;
static size_t left;
static const char *at = "start";
/* True if an argument of the present call is not MODERATE; true if the FMU has accepted such an argument from the present
 * input. */
static int offers_extreme, has_extreme;
static int long_steps;

void *instances[SLOTS];
void *states[SLOTS];
struct host_saved saved[SLOTS];
uint64_t nothing[8];
/* Arrays of the present call. */
static void *arrays[16];
static int arrays_count;

void fail(const char *what) {
    fprintf(stderr, "%s: %s\n", at, what);
    abort();
}

/* ---- Choices ---- */

unsigned byte(void) {
    if (!left)
        return 0;
    left--;
    return *bytes++;
}

int one_in(unsigned n) { return byte() % n == n - 1; }

uint64_t word(void) {
    uint64_t x = 0;
    for (int i = 0; i < 8; i++)
        x = x << 8 | byte();
    return x;
}

double real(void) {
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
    } else { /* a number of usual size */
        y = ((int)byte() - 128) * pow(10.0, (int)(kind % 8) - 6);
    }
    offers_extreme |= !MODERATE(y);
    return y;
}

int integer(void) {
    unsigned kind = byte();
    return kind < 200 ? (int)(kind % 13) - 1 : (int)word();
}

static unsigned reference(void) {
    unsigned kind = byte();
    if (kind < 4)
        return (unsigned)word();
    return kind < 60 ? kind % 30 : (kind << 8 | byte()) % references_end;
}

size_t length(void) {
    const size_t special[] = {0, 1, 1, 1, 2, 3, fmu->indicators, fmu->states};
    return special[byte() % 8];
}

const char *text(void) {
    static const char *special[] = {"", "one", " ", "%s%n%d", "logEvents", "logAll", "logStatusError",
                                    "\xff\xfe", "a\nb", "logStatusDiscard"};
    unsigned kind = byte();
    if (kind == 255)
        return NULL;
    return special[kind % 10];
}

/* ---- Arguments ---- */

/* Returns an array of n elements, which the next `done` frees, or sometimes NULL. */
void *array(size_t n, size_t size) {
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

double *reals(size_t n) {
    double *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = real();
    return x;
}

int *integers(size_t n) {
    int *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = integer();
    return x;
}

unsigned *references(size_t n) {
    unsigned *x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = reference();
    return x;
}

const char **texts(size_t n) {
    const char **x = array(n, sizeof *x);
    for (size_t i = 0; x && i < n; i++)
        x[i] = text();
    return x;
}

/* Returns the number of a slot. It is usually 0, so that most calls use the same instance. */
int slot(void) {
    unsigned kind = byte();
    return kind < 160 ? 0 : (int)(kind % SLOTS);
}

void *instance(void) {
    unsigned kind = byte();
    switch (kind) {
    case 255: return NULL;
    case 254: return nothing;
    case 253: return (char *)nothing + 1;
    case 252: return states[0];
    default: return instances[kind < 160 ? 0 : kind % SLOTS];
    }
}

void *state(void) {
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

void begin(const char *name) {
    at = name;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begun);
    feclearexcept(EXCEPTIONS);
}

void timed(void) {
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

int done(int status) {
    int raised = fetestexcept(EXCEPTIONS);
    timed();
    if (status != HOST_OK && status != HOST_DISCARD && status != HOST_ERROR)
        fail("returned neither OK nor Discard nor Error");
    has_extreme |= offers_extreme && status == HOST_OK;
    offers_extreme = 0;
    if (status == HOST_OK && raised && !has_extreme)
        fail("raised a floating-point exception, which a host may trap");
    if (status == HOST_OK)
        host_report.accepted++;
    host_report.errors += status == HOST_ERROR;
    while (arrays_count)
        free(arrays[--arrays_count]);
    return status;
}

double shortened(double h) {
    /* The model limits the work of a long step, but it is slow, so that there is only one per input. */
    return h > 1.0 && isfinite(h) && long_steps++ >= LONG_STEPS ? 1.0 : h;
}

struct host_call suspend(void) {
    struct host_call outer = {at, offers_extreme, fetestexcept(EXCEPTIONS)};
    offers_extreme = 0;
    return outer;
}

void resume(struct host_call outer) {
    at = outer.name;
    offers_extreme |= outer.offers_extreme;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begun);
    feclearexcept(EXCEPTIONS);
    feraiseexcept(outer.raised);
}

void judge_message(int status, const char *category, const char *message) {
    if (!message || !*message)
        fail("the logger got no message");
    if (status == HOST_FATAL) {
        fprintf(stderr, "%s\n", message);
        fail("the FMU panicked");
    }
    if (!category || strncmp(category, "log", 3))
        fail("the logger got an unknown category");
    host_report.messages++;
}

void check_outputs(unsigned first, int (*read)(void *, const unsigned *, size_t, double *), void *c) {
    unsigned all[MAX_OUTPUTS];
    double values[MAX_OUTPUTS];
    if (fmu->outputs > MAX_OUTPUTS)
        fail("the FMU has more outputs than MAX_OUTPUTS");
    for (unsigned i = 0; i < fmu->outputs; i++)
        all[i] = first + i;
    if (read(c, all, fmu->outputs, values) != HOST_OK)
        fail("the outputs cannot be read after a successful step");
    for (unsigned i = 0; i < fmu->outputs; i++) {
        if (!isfinite(values[i])) {
            fprintf(stderr, "output %u is %g\n", first + i, values[i]);
            fail("an output is not finite after a successful step");
        }
    }
}

void host_run(const struct host_fmu *the_fmu, const uint8_t *data, size_t size) {
    int version = size && data[0] % 2 ? 3 : 2;
    const struct host_version *with = version == 2 ? &host_fmi2 : &host_fmi3;
    fmu = the_fmu;
    references_end = (unsigned)(fmu->variables + fmu->indicators + 9);
    bytes = data + (size > 0);
    left = size - (size > 0);
    long_steps = offers_extreme = has_extreme = 0;
    with->start();
    for (int n = 0; n < CALLS && left; n++)
        with->call();
    /* The instances free their saved states. */
    left = 0;
    with->end();
    for (int i = 0; i < SLOTS; i++) {
        free(saved[i].bytes);
        saved[i].bytes = NULL;
        saved[i].size = 0;
    }
    host_report.inputs++;
}
