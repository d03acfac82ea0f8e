/* A library around our FMU that misbehaves in one way, for the tests of `hubslosh check`. Every call is passed on to
 * real.so in the same folder, except for the calls of the misbehaviour that the word in misbehaviour.txt selects. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <fenv.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2.h"

typedef void *Component;
typedef const unsigned *References;

static void *real;
static char word[64], guid[64];
static struct callbacks host;           /* a copy of the host's callbacks, as it should be */
static const struct callbacks *kept;    /* the host's own struct, which is a misbehaviour */
static int loads, instances, steps, terminated, initialised;
static double reached, start_of;
static double lag;                      /* total length of the steps that were not passed on */
static double tuned;                    /* value of friction.b that was set but not passed on */
static int is_tuned;

static int is(const char *name) { return strcmp(word, name) == 0; }

static void *find(const char *name) { return dlsym(real, name); }

static unsigned friction_b; /* value reference of a tunable parameter */

/* Calls the function of the same name in real.so. */
#define REAL(type, name, parameters) ((type(*) parameters)find(#name))

__attribute__((constructor)) static void load(void)
{
    Dl_info own;
    char path[4096];
    FILE *file;
    const char *before = getenv("SHIM_LOADS");
    dladdr((void *)load, &own);
    snprintf(path, sizeof path - 32, "%s", own.dli_fname);
    strcpy(strrchr(path, '/'), "/misbehaviour.txt");
    file = fopen(path, "r");
    if (!file || fscanf(file, "%63s %63s %u", word, guid, &friction_b) != 3)
        abort();
    fclose(file);
    strcpy(strrchr(path, '/'), "/real.so");
    real = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!real)
        abort();
    loads = before ? atoi(before) : 0;
    if (is("remembers_loads")) {
        snprintf(path, sizeof path, "%d", loads + 1);
        setenv("SHIM_LOADS", path, 1);
    }
    if (is("crashes_when_loaded"))
        abort();
}

static void log_text(void *environment, String instance, Status status, String category,
                     String format, ...)
{
    char text[4096];
    const struct callbacks *to = is("keeps_callbacks") && kept ? kept : &host;
    va_list all;
    va_start(all, format);
    vsnprintf(text, sizeof text - 2, format, all);
    va_end(all);
    if (!to->logger || is("swallows_messages"))
        return;
    if (is("hands_its_own")) /* a pointer of this library in place of the host's */
        environment = &host;
    if (is("text_as_format")) {
        to->logger(environment, instance, status, category, text);
        return;
    }
    if (is("line_break"))
        strcat(text, "\n");
    if (is("not_utf8"))
        text[0] = (char)0xff;
    to->logger(environment, instance, status, is("odd_category") ? "odd" : category, "%s", text);
}

const char *fmi2GetTypesPlatform(void) { return is("types_platform") ? "standard32" : "default"; }
const char *fmi2GetVersion(void) { return is("version") ? "2.1" : "2.0"; }

Component fmi2Instantiate(String name, int type, String id, String resources,
                          const struct callbacks *functions, int visible, int logging)
{
    struct callbacks mine;
    Component made;
    host = *functions;
    kept = functions;
    if (is("needs_callbacks") && !functions->allocate)
        return NULL;
    if (is("needs_resources") && !resources)
        return NULL;
    if (is("any_guid"))
        id = guid;
    if (is("rounds_up"))
        fesetround(FE_UPWARD);
    if (is("changes_directory") && chdir("/") != 0)
        return NULL;
    if (is("leaks_files") && open("/dev/null", O_RDONLY) < 0)
        return NULL;
    mine = *functions;
    mine.logger = functions->logger ? log_text : NULL;
    instances++;
    steps = terminated = initialised = is_tuned = 0;
    lag = 0;
    made = REAL(Component, fmi2Instantiate,
                (String, int, String, String, const struct callbacks *, int, int))(
        name, type, id, resources, &mine, visible, logging);
    return made;
}

void fmi2FreeInstance(Component c)
{
    if (is("free_null_crashes") && !c)
        abort();
    if (is("frees_nothing"))
        return;
    REAL(void, fmi2FreeInstance, (Component))(c);
}

Status fmi2SetDebugLogging(Component c, int on, size_t n, const String *categories)
{
    if (is("wants_categories") && n == 0)
        return ERROR;
    return REAL(Status, fmi2SetDebugLogging, (Component, int, size_t, const String *))(c, on, n,
                                                                                        categories);
}

Status fmi2SetupExperiment(Component c, int tolerant, double tolerance, double start, int stops,
                           double stop)
{
    Status status;
    if (is("starts_at_zero") && start != 0)
        return ERROR;
    if (is("no_tolerance") && tolerant)
        return ERROR;
    if (is("passes_stop"))
        stops = 0;
    reached = start_of = start;
    status = REAL(Status, fmi2SetupExperiment, (Component, int, double, double, int, double))(
        c, tolerant, tolerance, start, stops, stop);
    return is("any_order") ? OK : status;
}

static Status plain(const char *name, Component c)
{
    if (is("null_crashes") && !c)
        abort();
    return ((Status(*)(Component))find(name))(c);
}

Status fmi2EnterInitializationMode(Component c) { return plain("fmi2EnterInitializationMode", c); }

Status fmi2ExitInitializationMode(Component c)
{
    if (is("never_initialises"))
        return ERROR;
    initialised = 1;
    return plain("fmi2ExitInitializationMode", c);
}

Status fmi2Terminate(Component c)
{
    terminated = 1;
    if (is("terminate_fails"))
        return ERROR;
    return plain("fmi2Terminate", c);
}

Status fmi2SetReal(Component c, References r, size_t n, const double *x);

Status fmi2Reset(Component c)
{
    const unsigned gravity = 14;
    const double other = 9.8;
    Status status;
    if (is("no_reset_when_terminated") && terminated)
        return ERROR;
    status = plain("fmi2Reset", c);
    if (is("resets_not_all"))
        fmi2SetReal(c, &gravity, 1, &other);
    steps = terminated = initialised = 0;
    return status;
}

Status fmi2GetReal(Component c, References r, size_t n, double *x)
{
    Status status;
    size_t i;
    if (is("wants_variables") && n == 0)
        return ERROR;
    status = REAL(Status, fmi2GetReal, (Component, References, size_t, double *))(c, r, n, x);
    if (is("writes_past") && status == OK)
        x[n] = 0;
    if (is("ignores_tunables") && is_tuned)
        for (i = 0; i < n; i++)
            if (r[i] == friction_b)
                x[i] = tuned;
    if (is("crashes_on_unknown") && status == ERROR)
        abort();
    if (is("any_reference"))
        return OK;
    if (is("warns") && status == OK)
        return WARNING;
    if (is("other_start"))
        for (i = 0; i < n; i++)
            if (r[i] == 14)
                x[i] *= 1 + 2e-14; /* the 14th digit */
    if (is("last_bit_of_start"))
        for (i = 0; i < n; i++)
            if (r[i] == 14)
                x[i] = nextafter(x[i], 100);
    if (is("not_a_number"))
        for (i = 0; i < n; i++)
            if (r[i] == 10)
                x[i] = NAN;
    for (i = 0; i < n; i++)
        if (r[i] == 0) { /* theta, an output and a state */
            if (is("counts_steps"))
                x[i] += 1e-3 * steps;
            if (is("counts_instances"))
                x[i] += 1e-12 * instances;
            if (is("remembers_loads"))
                x[i] += 1e-12 * loads;
        }
    return status;
}

Status fmi2GetInteger(Component c, References r, size_t n, int *x)
{
    Status status =
        REAL(Status, fmi2GetInteger, (Component, References, size_t, int *))(c, r, n, x);
    return is("any_type") ? OK : status;
}

Status fmi2GetBoolean(Component c, References r, size_t n, int *x)
{
    size_t i;
    Status status =
        REAL(Status, fmi2GetBoolean, (Component, References, size_t, int *))(c, r, n, x);
    for (i = 0; i < n && is("true_is_two"); i++)
        x[i] *= 2;
    return status;
}

Status fmi2GetString(Component c, References r, size_t n, String *x)
{
    return REAL(Status, fmi2GetString, (Component, References, size_t, String *))(c, r, n, x);
}

Status fmi2SetReal(Component c, References r, size_t n, const double *x)
{
    Status status;
    if (is("any_number") && n && !isfinite(x[0]))
        return OK;
    if (initialised && n == 1 && r[0] == friction_b) {
        if (is("refuses_tunables"))
            return ERROR;
        if (is("drops_tunables"))
            return OK;
        if (is("ignores_tunables")) {
            is_tuned = 1;
            tuned = x[0];
            return OK;
        }
    }
    if (is("forgets_settings") && n && r[0] != 12)
        return OK;
    status = REAL(Status, fmi2SetReal, (Component, References, size_t, const double *))(c, r, n, x);
    return is("sets_anything") ? OK : status;
}

Status fmi2SetInteger(Component c, References r, size_t n, const int *x)
{
    return REAL(Status, fmi2SetInteger, (Component, References, size_t, const int *))(c, r, n, x);
}
Status fmi2SetBoolean(Component c, References r, size_t n, const int *x)
{
    return REAL(Status, fmi2SetBoolean, (Component, References, size_t, const int *))(c, r, n, x);
}
Status fmi2SetString(Component c, References r, size_t n, const String *x)
{
    return REAL(Status, fmi2SetString, (Component, References, size_t, const String *))(c, r, n, x);
}

Status fmi2GetFMUstate(Component c, void **state)
{
    if (is("one_handle_only") && *state)
        return ERROR;
    if (is("saves_only_running") && !initialised)
        return ERROR;
    return REAL(Status, fmi2GetFMUstate, (Component, void **))(c, state);
}
Status fmi2SetFMUstate(Component c, void *state)
{
    if (is("restores_nothing") && state)
        return OK;
    return REAL(Status, fmi2SetFMUstate, (Component, void *))(c, state);
}
Status fmi2FreeFMUstate(Component c, void **state)
{
    if (is("keeps_states") && c && state) {
        *state = NULL;
        return OK;
    }
    return REAL(Status, fmi2FreeFMUstate, (Component, void **))(c, state);
}
Status fmi2SerializedFMUstateSize(Component c, void *state, size_t *size)
{
    return REAL(Status, fmi2SerializedFMUstateSize, (Component, void *, size_t *))(c, state, size);
}
Status fmi2SerializeFMUstate(Component c, void *state, char *bytes, size_t size)
{
    return REAL(Status, fmi2SerializeFMUstate, (Component, void *, char *, size_t))(c, state, bytes,
                                                                                    size);
}
Status fmi2DeSerializeFMUstate(Component c, const char *bytes, size_t size, void **state)
{
    Status status;
    if (is("reads_no_bytes") || (is("wants_setup") && !initialised))
        return ERROR;
    status = REAL(Status, fmi2DeSerializeFMUstate, (Component, const char *, size_t, void **))(
        c, bytes, size, state);
    if (is("reads_garbage") && status != OK)
        return fmi2GetFMUstate(c, state);
    return status;
}

Status fmi2GetDirectionalDerivative(Component c, References unknown, size_t n, References known,
                                    size_t m, const double *along, double *x)
{
    size_t i;
    Status status = REAL(Status, fmi2GetDirectionalDerivative,
                         (Component, References, size_t, References, size_t, const double *,
                          double *))(c, unknown, n, known, m, along, x);
    for (i = 0; i < n && is("wrong_directions"); i++)
        x[i] *= 1.5;
    return status;
}

Status fmi2SetRealInputDerivatives(Component c, References r, size_t n, const int *order,
                                   const double *x)
{
    if (is("no_slopes"))
        return ERROR;
    if (is("ignores_slopes"))
        return OK;
    return REAL(Status, fmi2SetRealInputDerivatives,
                (Component, References, size_t, const int *, const double *))(c, r, n, order, x);
}
Status fmi2GetRealOutputDerivatives(Component c, References r, size_t n, const int *order, double *x)
{
    size_t i;
    Status status = REAL(Status, fmi2GetRealOutputDerivatives,
                         (Component, References, size_t, const int *, double *))(c, r, n, order, x);
    for (i = 0; i < n && is("wrong_slopes"); i++)
        x[i] = 1.5 * x[i] + 1;
    for (i = 0; i < n && is("opposite_slopes"); i++)
        x[i] = -x[i];
    if (is("writes_past_orders"))
        ((int *)order)[n] = 0;
    if (is("writes_before") && n > 0)
        x[-1] = 0;
    if (is("writes_orders") && n > 0)
        ((int *)order)[0] = 0;
    return status;
}

Status fmi2DoStep(Component c, double t, double h, int forget)
{
    Status status;
    if (is("hangs_at_zero") && !(h > 0))
        for (;;)
            sleep(1);
    if (is("hangs_at_nan") && isnan(h))
        for (;;)
            sleep(1);
    if (is("any_step") && !(h > 0))
        return OK;
    if (is("leaks_in_steps") && !malloc(65536))
        return ERROR;
    if (is("swallows_small_steps")) {
        if (h > 0 && h < 1e-3 && initialised) {
            lag += h;
            return OK;
        }
        t -= lag;
    }
    if (is("terminates")) /* fmi2GetBooleanStatus then returns the reason */
        return DISCARD;
    if (is("any_point"))
        t = reached;
    if (is("exact_time") && t != reached)
        return ERROR;
    if (is("ends_the_process") && !initialised)
        _exit(0);
    if (is("discards") && steps > 50)
        return DISCARD;
    if (is("prints"))
        puts("a step");
    if (is("chatters") && host.logger)
        host.logger(host.environment, "x", OK, "logAll", "%s", "a step");
    status = REAL(Status, fmi2DoStep, (Component, double, double, int))(c, t, h, forget);
    if (status == OK) {
        steps++;
        reached = start_of + steps * h;
    }
    return status;
}
Status fmi2CancelStep(Component c) { return plain("fmi2CancelStep", c); }

Status fmi2GetStatus(Component c, int kind, Status *x)
{
    return REAL(Status, fmi2GetStatus, (Component, int, Status *))(c, kind, x);
}
Status fmi2GetRealStatus(Component c, int kind, double *x)
{
    return REAL(Status, fmi2GetRealStatus, (Component, int, double *))(c, kind, x);
}
Status fmi2GetIntegerStatus(Component c, int kind, int *x)
{
    return REAL(Status, fmi2GetIntegerStatus, (Component, int, int *))(c, kind, x);
}
Status fmi2GetBooleanStatus(Component c, int kind, int *x)
{
    if (is("terminates")) {
        *x = 1;
        return OK;
    }
    return REAL(Status, fmi2GetBooleanStatus, (Component, int, int *))(c, kind, x);
}
Status fmi2GetStringStatus(Component c, int kind, String *x)
{
    return REAL(Status, fmi2GetStringStatus, (Component, int, String *))(c, kind, x);
}

Status fmi2EnterEventMode(Component c) { return plain("fmi2EnterEventMode", c); }
Status fmi2EnterContinuousTimeMode(Component c) { return plain("fmi2EnterContinuousTimeMode", c); }
Status fmi2NewDiscreteStates(Component c, struct event_info *info)
{
    Status status =
        REAL(Status, fmi2NewDiscreteStates, (Component, struct event_info *))(c, info);
    if (is("endless_events"))
        info->needed = 1;
    if (is("terminates"))
        info->terminate = 1;
    if (is("hides_jumps"))
        info->values = 0;
    if (is("past_events")) {
        info->defined = 1;
        info->next = start_of - 1;
    }
    return status;
}
Status fmi2CompletedIntegratorStep(Component c, int forget, int *enter, int *terminate)
{
    return REAL(Status, fmi2CompletedIntegratorStep, (Component, int, int *, int *))(
        c, forget, enter, terminate);
}
Status fmi2SetTime(Component c, double t)
{
    return REAL(Status, fmi2SetTime, (Component, double))(c, t);
}
Status fmi2SetContinuousStates(Component c, const double *x, size_t n)
{
    return REAL(Status, fmi2SetContinuousStates, (Component, const double *, size_t))(c, x, n);
}

static Status vector(const char *name, Component c, double *x, size_t n)
{
    Status status = ((Status(*)(Component, double *, size_t))find(name))(c, x, n);
    return is("any_length") ? OK : status;
}
Status fmi2GetDerivatives(Component c, double *x, size_t n)
{
    Status status = vector("fmi2GetDerivatives", c, x, n);
    if (is("other_order") && n > 1) {
        double first = x[0];
        x[0] = x[1];
        x[1] = first;
    }
    if (is("writes_past_vectors") && status == OK)
        x[n] = 0;
    return status;
}
Status fmi2GetEventIndicators(Component c, double *x, size_t n)
{
    Status status = vector("fmi2GetEventIndicators", c, x, n);
    size_t i;
    for (i = 0; i < n && is("frozen_indicators"); i++)
        x[i] = 1;
    return status;
}
Status fmi2GetContinuousStates(Component c, double *x, size_t n)
{
    return vector("fmi2GetContinuousStates", c, x, n);
}
Status fmi2GetNominalsOfContinuousStates(Component c, double *x, size_t n)
{
    Status status = vector("fmi2GetNominalsOfContinuousStates", c, x, n);
    if (is("zero_nominals") && n)
        x[0] = 0;
    if (is("other_nominals") && n)
        x[n - 1] *= 2;
    return status;
}
