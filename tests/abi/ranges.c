/* A C host that traps floating-point exceptions and gives an FMU what its description allows: every
 * parameter and input at its smallest, its start and its largest value, one alone and random pairs, in
 * both interfaces. Each run initialises, reads everything, steps and differentiates, in a process of its
 * own. A value that the FMU refuses is no fault; a trap is, and so is a number that is none. What no
 * description allows, NaN and infinity, has to be refused.
 *
 *   ranges LIBRARY GUID STATES INDICATORS FILE PAIRS SEED
 *
 * FILE has a line for each scalar variable,
 *     v CAUSALITY TYPE REFERENCE MIN START MAX NAME    (CAUSALITY p, i or -; TYPE R, I or B)
 * and for what a scene, by its number from 0, sets before,
 *     s SCENE TYPE REFERENCE VALUE
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fenv.h>
#include <float.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fmi2Functions.h"

enum { MOST = 8000 };
#define TRAPS (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)

struct variable {
    char causality, type;
    fmi2ValueReference reference;
    double value[3];
    char name[80];
};
struct setting {
    int scene;
    char type;
    fmi2ValueReference reference;
    double value;
};
/* What is tried: a value, by its number or as such, of a variable. */
struct trial {
    const struct variable *variable;
    double value;
};

static struct variable variables[MOST];
static struct setting settings[MOST];
static int count, set_before, scenes;
static fmi2ValueReference reals[MOST], integers[MOST], booleans[MOST];
static size_t real_count, integer_count, boolean_count;
static fmi2ValueReference known[1], unknown[1];
static const char *guid;
static size_t states, indicators;
static int said; /* messages of the FMU */

static void *library;
#define CALL(name) ((name##TYPE *)dlsym(library, #name))

enum { FINE = 0, FAILED = 2, REFUSED = 3, NOT_A_NUMBER = 4, SILENT = 5, ACCEPTED = 6, TRAP = 10 };
/* Where in the run it is, for the report. */
static const char *const stages[] = {"set", "initialise", "read", "step", "differentiate", "integrate"};
static volatile int stage;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String format, ...)
{
    (void)environment, (void)name, (void)category, (void)format;
    said += status >= fmi2Discard;
}

/* Ends the process with the kind of the exception and the stage. */
static void trapped(int signal, siginfo_t *info, void *context)
{
    int kind = info->si_code == FPE_FLTDIV ? 0 : info->si_code == FPE_FLTOVF ? 1 : 2;
    (void)signal, (void)context;
    _exit(TRAP + 3 * stage + kind);
}

/* The run ends here unless the call was accepted; a refusal needs a reason. */
static void accepted(fmi2Status status)
{
    if (status == fmi2OK)
        return;
    _exit(status >= fmi2Fatal ? FAILED : said ? REFUSED : SILENT);
}

static fmi2Status set(fmi2Component c, char type, fmi2ValueReference reference, double value)
{
    int integer = type == 'R' ? 0 : (int)value;
    if (type == 'R')
        return CALL(fmi2SetReal)(c, &reference, 1, &value);
    if (type == 'I')
        return CALL(fmi2SetInteger)(c, &reference, 1, &integer);
    return CALL(fmi2SetBoolean)(c, &reference, 1, &integer);
}

static void read_all(fmi2Component c)
{
    static double x[MOST];
    static int n[MOST];
    stage = 2;
    accepted(CALL(fmi2GetReal)(c, reals, real_count, x));
    accepted(CALL(fmi2GetInteger)(c, integers, integer_count, n));
    accepted(CALL(fmi2GetBoolean)(c, booleans, boolean_count, n));
    for (size_t i = 0; i < real_count; i++)
        if (!isfinite(x[i]))
            _exit(NOT_A_NUMBER);
}

static void differentiate(fmi2Component c, fmi2Type type)
{
    const double along = 1;
    const int order = 1;
    double answer;
    stage = 4;
    accepted(CALL(fmi2GetDirectionalDerivative)(c, unknown, 1, known, 1, &along, &answer));
    if (type == fmi2CoSimulation)
        accepted(CALL(fmi2GetRealOutputDerivatives)(c, unknown, 1, &order, &answer));
}

static void stepping(fmi2Component c, const struct trial *trials, int n)
{
    static const double steps[] = {1e-3, 0.02, 0.02};
    const int order = 1;
    double t = 0;
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++) {
        /* inputs run towards 0 */
        for (int i = 0; k > 0 && i < n; i++) {
            double slope = -trials[i].value;
            if (trials[i].variable->causality == 'i')
                accepted(CALL(fmi2SetRealInputDerivatives)(c, &trials[i].variable->reference, 1,
                                                           &order, &slope));
        }
        stage = 3;
        accepted(CALL(fmi2DoStep)(c, t, steps[k], fmi2True));
        t += steps[k];
        read_all(c);
        differentiate(c, fmi2CoSimulation);
    }
}

static void events(fmi2Component c)
{
    fmi2EventInfo info;
    do
        accepted(CALL(fmi2NewDiscreteStates)(c, &info));
    while (info.newDiscreteStatesNeeded);
    accepted(CALL(fmi2EnterContinuousTimeMode)(c));
}

/* Explicit Euler steps, so short that they do not diverge for long; the host's own sums are not trapped. A state
 * that has grown beyond 1e9 has been made so by the host. */
static void exchange(fmi2Component c)
{
    static double x[MOST], rate[MOST], z[MOST];
    const double h = 1e-7;
    stage = 5;
    events(c);
    for (int n = 1; n <= 10; n++) {
        fmi2Boolean event = fmi2False, end = fmi2False;
        int grown = 0;
        accepted(CALL(fmi2GetContinuousStates)(c, x, states));
        accepted(CALL(fmi2GetDerivatives)(c, rate, states));
        accepted(CALL(fmi2GetEventIndicators)(c, z, indicators));
        fedisableexcept(TRAPS);
        for (size_t i = 0; i < states; i++) {
            x[i] += h * rate[i];
            grown |= !(fabs(x[i]) < 1e9);
        }
        feclearexcept(FE_ALL_EXCEPT);
        feenableexcept(TRAPS);
        if (grown)
            return;
        accepted(CALL(fmi2SetTime)(c, n * h));
        accepted(CALL(fmi2SetContinuousStates)(c, x, states));
        accepted(CALL(fmi2CompletedIntegratorStep)(c, fmi2True, &event, &end));
        accepted(CALL(fmi2EnterEventMode)(c));
        events(c);
        read_all(c);
        differentiate(c, fmi2ModelExchange);
        stage = 5;
    }
}

static fmi2Component initialised(fmi2Type type, int scene, const struct trial *trials, int n)
{
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    struct sigaction action = {.sa_sigaction = trapped, .sa_flags = SA_SIGINFO};
    fmi2Component c;
    sigaction(SIGFPE, &action, NULL);
    feenableexcept(TRAPS);
    c = CALL(fmi2Instantiate)("ranges", type, guid, "file:///nowhere", &callbacks, fmi2False, fmi2True);
    if (!c)
        _exit(FAILED);
    for (int i = 0; i < set_before; i++)
        if (settings[i].scene == scene &&
            set(c, settings[i].type, settings[i].reference, settings[i].value) != fmi2OK)
            _exit(FAILED);
    stage = 0;
    for (int i = 0; i < n; i++)
        accepted(set(c, trials[i].variable->type, trials[i].variable->reference, trials[i].value));
    stage = 1;
    accepted(CALL(fmi2SetupExperiment)(c, fmi2False, 0, 0, fmi2False, 0));
    accepted(CALL(fmi2EnterInitializationMode)(c));
    accepted(CALL(fmi2ExitInitializationMode)(c));
    return c;
}

static void allowed(fmi2Type type, int scene, const struct trial *trials, int n)
{
    fmi2Component c = initialised(type, scene, trials, n);
    read_all(c);
    if (type == fmi2CoSimulation)
        stepping(c, trials, n);
    else
        exchange(c);
    accepted(CALL(fmi2Terminate)(c));
    CALL(fmi2FreeInstance)(c);
    _exit(FINE);
}

/* What is no number is refused: when it is set, or with all other parameters when initialization ends; so are
 * slopes. */
static void forbidden(fmi2Type type, int scene, const struct trial *trials, int n)
{
    fmi2Component c;
    const int order = 1;
    if (trials->variable->causality == 'i' && type == fmi2CoSimulation) {
        c = initialised(type, scene, NULL, 0);
        if (CALL(fmi2SetRealInputDerivatives)(c, &trials->variable->reference, 1, &order,
                                              &trials->value) == fmi2OK)
            _exit(ACCEPTED);
        said = 0;
        accepted(set(c, 'R', trials->variable->reference, trials->value));
        _exit(ACCEPTED);
    }
    initialised(type, scene, trials, n);
    _exit(ACCEPTED);
}

static int runs, refused, ended;

/* One run in a process of its own. */
static void run(void (*what)(fmi2Type, int, const struct trial *, int), int scene, const struct trial *trials, int n)
{
    static const char *const traps[] = {"division by zero", "overflow", "invalid operation"};
    for (int type = 0; type <= 1; type++) {
        int status = 0, code;
        pid_t child;
        fflush(stdout);
        child = fork();
        if (child == 0) {
            what(type, scene, trials, n);
            _exit(FAILED);
        }
        if (child < 0 || waitpid(child, &status, 0) != child)
            exit(2);
        runs++;
        code = WIFEXITED(status) ? WEXITSTATUS(status) : FAILED;
        refused += code == REFUSED;
        if (code == FINE || code == REFUSED)
            continue;
        ended++;
        printf("%s, scene %d", type == fmi2CoSimulation ? "Co-Simulation" : "Model Exchange", scene);
        for (int i = 0; i < n; i++)
            printf(", %s = %.17g", trials[i].variable->name, trials[i].value);
        if (code >= TRAP)
            printf(": %s (%s)\n", traps[(code - TRAP) % 3], stages[(code - TRAP) / 3]);
        else
            printf(": %s\n", code == NOT_A_NUMBER ? "NaN or infinite with fmi2OK"
                             : code == SILENT     ? "refused without a message"
                             : code == ACCEPTED   ? "accepted"
                                                  : "the process ended");
    }
}

/* xorshift64*: the same numbers everywhere */
static uint64_t state;
static int below(int n)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (int)((state * 0x2545F4914F6CDD1DULL >> 33) % (uint64_t)n);
}

static void read_file(const char *path)
{
    char line[300];
    FILE *file = fopen(path, "r");
    if (!file)
        exit(2);
    while (fgets(line, sizeof line, file) && count < MOST && set_before < MOST) {
        struct variable *v = &variables[count];
        struct setting *s = &settings[set_before];
        if (sscanf(line, "v %c %c %u %lf %lf %lf %79s", &v->causality, &v->type, &v->reference,
                   &v->value[0], &v->value[1], &v->value[2], v->name) == 7) {
            if (v->type == 'R')
                reals[real_count++] = v->reference;
            else if (v->type == 'I')
                integers[integer_count++] = v->reference;
            else
                booleans[boolean_count++] = v->reference;
            count++;
        } else if (sscanf(line, "s %d %c %u %lf", &s->scene, &s->type, &s->reference, &s->value) == 4) {
            scenes = s->scene >= scenes ? s->scene + 1 : scenes;
            set_before++;
        } else
            exit(2);
    }
    fclose(file);
}

int main(int argc, char **argv)
{
    static const struct variable *settable[MOST];
    int n = 0;
    double signalling;
    const uint64_t bits = 0x7ff0000000000001;
    memcpy(&signalling, &bits, sizeof bits);
    const double none[] = {NAN, -NAN, signalling, INFINITY, -INFINITY};
    if (argc != 8) {
        fprintf(stderr, "usage: see the beginning of ranges.c\n");
        return 2;
    }
    guid = argv[2];
    states = strtoul(argv[3], NULL, 10);
    indicators = strtoul(argv[4], NULL, 10);
    read_file(argv[5]);
    state = strtoull(argv[7], NULL, 10);
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library || states > MOST || indicators > MOST) {
        fprintf(stderr, "error: %s\n", library ? "too many states" : dlerror());
        return 2;
    }
    for (int i = 0; i < count; i++) {
        if (variables[i].causality != '-')
            settable[n++] = &variables[i];
        if (variables[i].causality == 'i' && !known[0])
            known[0] = variables[i].reference;
    }
    unknown[0] = reals[0]; /* outputs come first */
    for (int scene = 0; scene < scenes; scene++)
        for (int i = 0; i < n; i++)
            for (int k = 0; k < 3; k++) {
                struct trial trial = {settable[i], settable[i]->value[k]};
                run(allowed, scene, &trial, 1);
            }
    for (int k = strtol(argv[6], NULL, 10); k > 0; k--) {
        struct trial trials[2];
        for (int i = 0; i < 2; i++) {
            trials[i].variable = settable[below(n)];
            trials[i].value = trials[i].variable->value[below(3)];
        }
        run(allowed, below(scenes), trials, 2);
    }
    for (int i = 0; i < n; i++)
        for (size_t k = 0; k < sizeof none / sizeof *none && settable[i]->type == 'R'; k++) {
            struct trial trial = {settable[i], none[k]};
            run(forbidden, 0, &trial, 1);
        }
    printf("%d runs, %d refused, %d faults\n", runs, refused, ended);
    return ended > 0;
}
