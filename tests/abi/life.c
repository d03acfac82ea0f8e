/* A C host that lives a whole life with the packed FMU's binary: both interfaces, saved states,
 * many instances at once, loading and unloading. Ends with a sentence on the first thing that is
 * not as it should be; leaks nothing itself, so that valgrind's count is the FMU's.
 *
 *   life LIBRARY GUID INSTANCES LOADS OMEGA OMEGA_DOT TAU_CMD SLOSH_MODEL INIT_OMEGA
 *
 * The functions' types are the official headers'. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2Functions.h"

/* From the model description. */
static fmi2ValueReference omega, omega_dot, tau_cmd, slosh_model, init_omega;
static const char *guid;

#define FUNCTION(name) static name##TYPE *name##_
FUNCTION(fmi2Instantiate);
FUNCTION(fmi2FreeInstance);
FUNCTION(fmi2SetupExperiment);
FUNCTION(fmi2EnterInitializationMode);
FUNCTION(fmi2ExitInitializationMode);
FUNCTION(fmi2Terminate);
FUNCTION(fmi2Reset);
FUNCTION(fmi2SetDebugLogging);
FUNCTION(fmi2GetReal);
FUNCTION(fmi2SetReal);
FUNCTION(fmi2SetInteger);
FUNCTION(fmi2GetFMUstate);
FUNCTION(fmi2SetFMUstate);
FUNCTION(fmi2FreeFMUstate);
FUNCTION(fmi2SerializedFMUstateSize);
FUNCTION(fmi2SerializeFMUstate);
FUNCTION(fmi2DeSerializeFMUstate);
FUNCTION(fmi2GetDirectionalDerivative);
FUNCTION(fmi2DoStep);
FUNCTION(fmi2GetRealOutputDerivatives);
FUNCTION(fmi2SetRealInputDerivatives);
FUNCTION(fmi2NewDiscreteStates);
FUNCTION(fmi2EnterEventMode);
FUNCTION(fmi2EnterContinuousTimeMode);
FUNCTION(fmi2CompletedIntegratorStep);
FUNCTION(fmi2SetTime);
FUNCTION(fmi2SetContinuousStates);
FUNCTION(fmi2GetContinuousStates);
FUNCTION(fmi2GetDerivatives);
FUNCTION(fmi2GetEventIndicators);

static unsigned long messages;

static void fail(const char *what) {
    fprintf(stderr, "error: %s\n", what);
    exit(1);
}

#define MUST(status) do { if ((status) != fmi2OK) fail(#status " is not fmi2OK"); } while (0)

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String format, ...) {
    (void)environment, (void)name, (void)status, (void)category;
    va_list list;
    va_start(list, format);
    char text[4000];
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    messages++;
}

/* ---- Loading ---- */

static void *load(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        fail(dlerror());
#define FIND(name) if (!(*(void **)&name##_ = dlsym(library, #name))) fail(#name " is missing")
    FIND(fmi2Instantiate);
    FIND(fmi2FreeInstance);
    FIND(fmi2SetupExperiment);
    FIND(fmi2EnterInitializationMode);
    FIND(fmi2ExitInitializationMode);
    FIND(fmi2Terminate);
    FIND(fmi2Reset);
    FIND(fmi2SetDebugLogging);
    FIND(fmi2GetReal);
    FIND(fmi2SetReal);
    FIND(fmi2SetInteger);
    FIND(fmi2GetFMUstate);
    FIND(fmi2SetFMUstate);
    FIND(fmi2FreeFMUstate);
    FIND(fmi2SerializedFMUstateSize);
    FIND(fmi2SerializeFMUstate);
    FIND(fmi2DeSerializeFMUstate);
    FIND(fmi2GetDirectionalDerivative);
    FIND(fmi2DoStep);
    FIND(fmi2GetRealOutputDerivatives);
    FIND(fmi2SetRealInputDerivatives);
    FIND(fmi2NewDiscreteStates);
    FIND(fmi2EnterEventMode);
    FIND(fmi2EnterContinuousTimeMode);
    FIND(fmi2CompletedIntegratorStep);
    FIND(fmi2SetTime);
    FIND(fmi2SetContinuousStates);
    FIND(fmi2GetContinuousStates);
    FIND(fmi2GetDerivatives);
    FIND(fmi2GetEventIndicators);
    return library;
}

/* Whether the library is still among what the process has mapped. */
static int is_mapped(const char *path) {
    FILE *maps = fopen("/proc/self/maps", "r");
    char line[4096];
    int found = 0;
    while (maps && fgets(line, sizeof line, maps))
        found |= strstr(line, path) != NULL;
    if (maps)
        fclose(maps);
    return found;
}

static void unload(void *library, const char *path) {
    if (dlclose(library))
        fail(dlerror());
    if (is_mapped(path))
        fail("the library is still there after it was unloaded");
}

/* Kilobytes that the process has in memory. */
static long memory(void) {
    FILE *file = fopen("/proc/self/statm", "r");
    long all = 0, resident = 0;
    if (!file || fscanf(file, "%ld %ld", &all, &resident) != 2)
        fail("/proc/self/statm cannot be read");
    fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

/* Open descriptors. */
static int descriptors(void) {
    int n = 0;
    for (int fd = 0; fd < 1024; fd++)
        n += lseek(fd, 0, SEEK_CUR) != -1 || isatty(fd);
    return n;
}

/* ---- Life ---- */

static fmi2Component begin(fmi2Type type, int model) {
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    fmi2Component c = fmi2Instantiate_("life", type, guid, "file:///nowhere", &callbacks, 0, 1);
    if (!c)
        fail("no instance");
    double rate = 0.3;
    MUST(fmi2SetInteger_(c, &slosh_model, 1, &model));
    MUST(fmi2SetReal_(c, &init_omega, 1, &rate));
    MUST(fmi2SetupExperiment_(c, 1, 1e-8, 0.0, 1, 100.0));
    MUST(fmi2EnterInitializationMode_(c));
    MUST(fmi2ExitInitializationMode_(c));
    return c;
}

static double step(fmi2Component c, double t, double torque) {
    int order = 1;
    double slope = 0.01, rate;
    MUST(fmi2SetReal_(c, &tau_cmd, 1, &torque));
    MUST(fmi2SetRealInputDerivatives_(c, &tau_cmd, 1, &order, &slope));
    MUST(fmi2DoStep_(c, t, 0.1, 1));
    MUST(fmi2GetReal_(c, &omega, 1, &rate));
    return rate;
}

static void co_simulation(int model) {
    fmi2Component c = begin(fmi2CoSimulation, model);
    MUST(fmi2SetDebugLogging_(c, 1, 0, NULL));
    for (int n = 0; n < 10; n++)
        step(c, 0.1 * n, 0.02 * (n % 3 - 1));
    /* a state there and back, as handle and as bytes */
    fmi2FMUstate state = NULL, read = NULL;
    size_t size = 0;
    MUST(fmi2GetFMUstate_(c, &state));
    MUST(fmi2SerializedFMUstateSize_(c, state, &size));
    char *bytes = malloc(size);
    MUST(fmi2SerializeFMUstate_(c, state, bytes, size));
    double first = step(c, 1.0, 0.05);
    MUST(fmi2SetFMUstate_(c, state));
    double second = step(c, 1.0, 0.05);
    MUST(fmi2DeSerializeFMUstate_(c, bytes, size, &read));
    MUST(fmi2SetFMUstate_(c, read));
    double third = step(c, 1.0, 0.05);
    if (first != second || first != third)
        fail("a state that was set back gives another motion");
    MUST(fmi2GetFMUstate_(c, &state));
    MUST(fmi2FreeFMUstate_(c, &state));
    MUST(fmi2FreeFMUstate_(c, &read));
    free(bytes);
    int order = 1;
    double slope, along = 1.0, answer;
    MUST(fmi2GetRealOutputDerivatives_(c, &omega, 1, &order, &slope));
    MUST(fmi2GetDirectionalDerivative_(c, &omega_dot, 1, &tau_cmd, 1, &along, &answer));
    /* what is refused, with a message */
    if (fmi2DoStep_(c, 0.0, -1.0, 1) != fmi2Error || fmi2GetReal_(c, NULL, 1, NULL) != fmi2Error)
        fail("a call that makes no sense was accepted");
    MUST(fmi2Terminate_(c));
    MUST(fmi2Reset_(c));
    fmi2FreeInstance_(c);
}

static void model_exchange(int model) {
    /* STATES and INDICATORS come from the compiler's command line. */
    fmi2Component c = begin(fmi2ModelExchange, model);
    fmi2EventInfo info;
    double x[STATES], rates[STATES], indicators[INDICATORS], before[INDICATORS];
    MUST(fmi2NewDiscreteStates_(c, &info));
    MUST(fmi2EnterContinuousTimeMode_(c));
    MUST(fmi2GetEventIndicators_(c, before, INDICATORS));
    for (int n = 1; n <= 2000; n++) {
        MUST(fmi2GetContinuousStates_(c, x, STATES));
        MUST(fmi2GetDerivatives_(c, rates, STATES));
        for (int i = 0; i < STATES; i++)
            x[i] += 1e-3 * rates[i];
        MUST(fmi2SetTime_(c, 1e-3 * n));
        MUST(fmi2SetContinuousStates_(c, x, STATES));
        MUST(fmi2GetEventIndicators_(c, indicators, INDICATORS));
        int event = 0, terminate = 0;
        MUST(fmi2CompletedIntegratorStep_(c, 1, &event, &terminate));
        for (int i = 0; i < INDICATORS; i++)
            event |= (indicators[i] > 0) != (before[i] > 0);
        if (event) {
            double torque = 0.02 * (n % 5 - 2);
            MUST(fmi2EnterEventMode_(c));
            MUST(fmi2SetReal_(c, &tau_cmd, 1, &torque));
            MUST(fmi2NewDiscreteStates_(c, &info));
            MUST(fmi2EnterContinuousTimeMode_(c));
            MUST(fmi2GetEventIndicators_(c, indicators, INDICATORS));
        }
        memcpy(before, indicators, sizeof before);
    }
    MUST(fmi2Terminate_(c));
    fmi2FreeInstance_(c);
}

/* Instances at once, in turns, every one as if it were alone. */
static void many(int count) {
    fmi2Component *all = malloc((size_t)count * sizeof *all);
    double alone[5][3];
    for (int model = 0; model < 5; model++) {
        fmi2Component c = begin(fmi2CoSimulation, model + 1);
        for (int n = 0; n < 3; n++)
            alone[model][n] = step(c, 0.1 * n, 0.03);
        fmi2FreeInstance_(c);
    }
    for (int i = 0; i < count; i++)
        all[i] = begin(fmi2CoSimulation, i % 5 + 1);
    for (int n = 0; n < 3; n++)
        for (int i = 0; i < count; i++)
            if (step(all[i], 0.1 * n, 0.03) != alone[i % 5][n])
                fail("an instance among many moves otherwise than alone");
    for (int i = 0; i < count; i++)
        fmi2FreeInstance_(all[i]);
    free(all);
}

int main(int count, char **arguments) {
    if (count != 10) {
        fprintf(stderr, "usage: see the beginning of life.c\n");
        return 2;
    }
    const char *path = arguments[1];
    guid = arguments[2];
    int instances = atoi(arguments[3]), loads = atoi(arguments[4]);
    fmi2ValueReference *references[] = {&omega, &omega_dot, &tau_cmd, &slosh_model, &init_omega};
    for (int i = 0; i < 5; i++)
        *references[i] = (fmi2ValueReference)strtoul(arguments[5 + i], NULL, 10);

    void *library = load(path);
    for (int model = 1; model <= 5; model++) {
        co_simulation(model);
        model_exchange(model);
    }
    many(instances);
    unload(library, path);

    /* The first loads fill caches of the dynamic linker's and malloc's. */
    long at_first = 0;
    int open_at_first = 0;
    for (int n = 0; n < loads; n++) {
        library = load(path);
        fmi2Component c = begin(fmi2CoSimulation, n % 5 + 1);
        step(c, 0.0, 0.03);
        /* a panic hook or a thread's destructor left behind would point to code that is gone */
        if (fmi2DoStep_(c, NAN, 1.0, 1) != fmi2Error)
            fail("a call that makes no sense was accepted");
        fmi2FreeInstance_(c);
        unload(library, path);
        if (n == loads / 10) {
            at_first = memory();
            open_at_first = descriptors();
        }
    }
    printf("%d instances at once, loaded %d times, %ld KiB more memory since then, %d more descriptors, "
           "%lu messages\n",
           instances, loads + 1, memory() - at_first, descriptors() - open_at_first, messages);
    return 0;
}
