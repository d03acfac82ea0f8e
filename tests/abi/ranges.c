/* A C host that traps floating-point exceptions and sets all values that the FMU's description allows: every parameter
 * and input to its smallest, its start and its largest value, one at a time, and random pairs of any allowed values, in
 * both interfaces. Each run initialises the FMU, reads all variables, makes steps and asks for derivatives, in a
 * separate process. The FMU may refuse a value, but a trap is a fault, and so is NaN or infinity in a result. The FMU
 * must refuse values that no description allows: NaN and infinity.
 *
 *   ranges LIBRARY GUID STATES INDICATORS FILE PAIRS SEED all|part
 *
 * FILE has a line for each scalar variable,
 *     v CAUSALITY TYPE REFERENCE MIN START MAX NAME    (CAUSALITY p, i or -; TYPE R, I, E or B)
 * and a line for each value that a scene, with its number from 0, sets first,
 *     s SCENE TYPE REFERENCE VALUE
 *
 * With `part`, each end of a range is set in only one scene, by at least one version of FMI (fmi.h); the scene changes
 * from variable to variable. Start values are set once in every scene. One version sets each Real to NaN and the other
 * to infinity. Model Exchange makes three steps instead of ten. */
#define _GNU_SOURCE
#include "fmi.h"
#include <float.h>
#include <signal.h>
#include <stdint.h>
#include <sys/wait.h>

enum { MOST = 8000 };
#define TRAPS (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)

struct variable {
    char causality, type;
    Reference reference;
    double value[3];
    char name[80];
};
struct setting {
    int scene;
    char type;
    Reference reference;
    double value;
};
/* One value to be set: a variable, and the number of one of its special values or a value. */
struct trial {
    const struct variable *variable;
    double value;
};

static struct variable variables[MOST];
static struct setting settings[MOST];
static int count, set_before, scenes, part;
static Reference references[4][MOST]; /* by type */
static const char types[] = "RIEB";
static size_t counts[4];
static Reference known, unknown;
static size_t states, indicators;

enum { FINE = 0, FAILED = 2, REFUSED = 3, NOT_A_NUMBER = 4, SILENT = 5, ACCEPTED = 6, TRAP = 10 };
/* The present stage of a run, for the report. */
static const char *const stages[] = {"set", "initialise", "read", "step", "differentiate", "integrate", "diverge"};
static volatile int stage;

/* Ends the process with the kind of the exception and the stage. */
static void trapped(int signal, siginfo_t *info, void *context)
{
    int kind = info->si_code == FPE_FLTDIV ? 0 : info->si_code == FPE_FLTOVF ? 1 : 2;
    (void)signal, (void)context;
    _exit(TRAP + 3 * stage + kind);
}

/* Ends the run unless the call was accepted. The FMU must log a reason for a refusal. */
static void accepted(Status status)
{
    if (status == OK)
        return;
    _exit(status >= FATAL ? FAILED : reasons ? REFUSED : SILENT);
}

static void read_all(Instance c)
{
    static double x[MOST];
    stage = 2;
    accepted(get_reals(c, references[0], counts[0], x));
    for (int type = 1; type < 4; type++)
        accepted(read_others(c, types[type], references[type], counts[type]));
    for (size_t i = 0; i < counts[0]; i++)
        if (!isfinite(x[i]))
            _exit(NOT_A_NUMBER);
}

static void differentiate(Instance c, int kind)
{
    double answer;
    stage = 4;
    accepted(derivative(c, unknown, known, &answer));
    if (kind == CO_SIMULATION)
        accepted(output_derivative(c, unknown, &answer));
}

static void stepping(Instance c, const struct trial *trials, int n)
{
    static const double steps[] = {1e-3, 0.02, 0.02};
    double t = 0;
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++) {
        /* the inputs change linearly towards 0 */
        for (int i = 0; k > 0 && i < n; i++)
            if (trials[i].variable->causality == 'i')
                accepted(ramp(c, trials[i].variable->reference, t, -trials[i].value));
        stage = 3;
        accepted(do_step(c, t, steps[k]));
        t += steps[k];
        read_all(c);
        differentiate(c, CO_SIMULATION);
    }
}

/* numbers of runs with allowed values, of those that were refused, of runs with forbidden values, and of faults */
static int runs, refused, others, ended;

/* Returns true if the FMU has accepted a call of a diverging host. The FMU must log a reason for a refusal. */
static int taken(Status status)
{
    if (status != OK && !reasons)
        _exit(SILENT);
    return status == OK;
}

/* The integration of the host diverges: the states grow from any size until the FMU refuses them. Before that nothing
 * may overflow, and every result must be a finite number. */
static void diverge(Instance c, double *x)
{
    static double rate[MOST], z[MOST], y[MOST];
    double size = pow(10, runs % 30);
    for (;; size *= 3e7) {
        int event;
        for (size_t i = 0; i < states; i++)
            x[i] = (fabs(x[i]) > 1e-3 ? x[i] / fabs(x[i]) : i % 2 ? 1 : -1) * size * (1 + 0.1 * (i % 7));
        stage = 6;
        if (!taken(set_states(c, x, states)) || !taken(get_rates(c, rate, states)) ||
            !taken(get_indicators(c, z, indicators)) || !taken(get_reals(c, references[0], counts[0], y)))
            return;
        for (size_t i = 0; i < counts[0]; i++)
            if (!isfinite(y[i]))
                _exit(NOT_A_NUMBER);
        for (int type = 1; type < 4; type++)
            if (!taken(read_others(c, types[type], references[type], counts[type])))
                return;
        if (!taken(derivative(c, unknown, known, y)) || !taken(completed_step(c, &event)) ||
            !taken(enter_event_mode(c)) || !taken(to_continuous_time(c)))
            return;
    }
}

/* Makes explicit Euler steps, which are so short that they do not diverge for a while. The sums of the host itself are
 * not trapped. A state above 1e9 is caused by the host. */
static void exchange(Instance c)
{
    static double x[MOST], rate[MOST], z[MOST];
    const double h = 1e-7;
    stage = 5;
    accepted(to_continuous_time(c));
    for (int n = 1; n <= (part ? 3 : 10); n++) {
        int event, grown = 0;
        accepted(get_states(c, x, states));
        accepted(get_rates(c, rate, states));
        accepted(get_indicators(c, z, indicators));
        fedisableexcept(TRAPS);
        for (size_t i = 0; i < states; i++) {
            x[i] += h * rate[i];
            grown |= !(fabs(x[i]) < 1e9);
        }
        feclearexcept(FE_ALL_EXCEPT);
        feenableexcept(TRAPS);
        if (grown)
            return;
        accepted(set_time(c, n * h));
        accepted(set_states(c, x, states));
        accepted(completed_step(c, &event));
        accepted(enter_event_mode(c));
        accepted(to_continuous_time(c));
        read_all(c);
        differentiate(c, MODEL_EXCHANGE);
        stage = 5;
    }
    stage = 6;
    diverge(c, x);
}

static Instance initialised(int kind, int scene, const struct trial *trials, int n)
{
    struct sigaction action = {.sa_sigaction = trapped, .sa_flags = SA_SIGINFO};
    Instance c;
    sigaction(SIGFPE, &action, NULL);
    feenableexcept(TRAPS);
    c = instantiate(kind);
    if (!c)
        _exit(FAILED);
    for (int i = 0; i < set_before; i++)
        if (settings[i].scene == scene &&
            set_value(c, settings[i].type, settings[i].reference, settings[i].value) != OK)
            _exit(FAILED);
    stage = 0;
    for (int i = 0; i < n; i++)
        accepted(set_value(c, trials[i].variable->type, trials[i].variable->reference, trials[i].value));
    stage = 1;
    accepted(initialise(c, kind, 0, 0));
    return c;
}

static void allowed(int kind, int scene, const struct trial *trials, int n)
{
    Instance c = initialised(kind, scene, trials, n);
    read_all(c);
    if (kind == CO_SIMULATION)
        stepping(c, trials, n);
    else
        exchange(c);
    /* An instance whose integration diverged need not accept fmi2Terminate. */
    if (kind == MODEL_EXCHANGE && reasons)
        _exit(FINE);
    accepted(terminate(c));
    free_instance(c);
    _exit(FINE);
}

/* NaN and infinity must be refused when they are set, or when initialization ends, with all other parameters. The same
 * holds for slopes, which in FMI 3.0 are given by the end of the line within the step. */
static void forbidden(int kind, int scene, const struct trial *trials, int n)
{
    Reference input = trials->variable->reference;
    Instance c;
    if (trials->variable->causality == 'i' && kind == CO_SIMULATION) {
        c = initialised(kind, scene, NULL, 0);
        if (ramp(c, input, 0, trials->value) == OK && (FMI == 2 || do_step(c, 0, 1e-3) == OK))
            _exit(ACCEPTED);
        reasons = 0;
        accepted(set_value(c, 'R', input, trials->value));
        _exit(ACCEPTED);
    }
    initialised(kind, scene, trials, n);
    _exit(ACCEPTED);
}

/* Makes one run in a separate process. */
static void run(void (*what)(int, int, const struct trial *, int), int scene, const struct trial *trials, int n)
{
    static const char *const traps[] = {"division by zero", "overflow", "invalid operation"};
    for (int kind = 0; kind < KINDS; kind++) {
        int status = 0, code;
        pid_t child;
        fflush(stdout);
        child = fork();
        if (child == 0) {
            what(kind, scene, trials, n);
            _exit(FAILED);
        }
        if (child < 0 || waitpid(child, &status, 0) != child)
            exit(2);
        runs += what == allowed;
        others += what == forbidden;
        code = WIFEXITED(status) ? WEXITSTATUS(status) : FAILED;
        refused += what == allowed && code == REFUSED;
        if (code == FINE || code == REFUSED)
            continue;
        ended++;
        printf("%s, scene %d", kind == CO_SIMULATION ? "Co-Simulation" : "Model Exchange", scene);
        for (int i = 0; i < n; i++)
            printf(", %s = %.17g", trials[i].variable->name, trials[i].value);
        if (code >= TRAP)
            printf(": %s (%s)\n", traps[(code - TRAP) % 3], stages[(code - TRAP) / 3]);
        else
            printf(": %s\n", code == NOT_A_NUMBER ? "NaN or infinite, and all is well"
                             : code == SILENT     ? "refused without a message"
                             : code == ACCEPTED   ? "accepted"
                                                  : "the process ended");
    }
}

/* xorshift64*, which gives the same numbers on every platform */
static uint64_t state;
static int below(int n)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (int)((state * 0x2545F4914F6CDD1DULL >> 33) % (uint64_t)n);
}

/* Returns an allowed value of a variable: an end or the start value of its range, the value nearest to 0, or a random
 * one; Reals have any magnitude from 1e-12 on. */
static double any_value(const struct variable *v)
{
    const double low = v->value[0], high = v->value[2];
    const int which = below(5);
    double x = 0;
    if (which < 3)
        return v->value[which];
    if (which == 4 && v->type == 'R') {
        const double most = fmax(fabs(low), fabs(high));
        x = exp(log(1e-12) + (log(most) - log(1e-12)) * below(1 << 20) / (1 << 20));
        x = below(2) ? x : -x;
    } else if (which == 4)
        x = low + below((int)fmin(high - low + 1, 1e6));
    return fmin(fmax(x, low), high);
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
            const char *type = strchr(types, v->type);
            if (!type)
                exit(2);
            references[type - types][counts[type - types]++] = v->reference;
#if FMI == 3
            if (v->causality == 'i' && v->type == 'R' && movable_count < sizeof movable / sizeof *movable)
                movable[movable_count++] = v->reference;
#endif
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
    if (argc != 9) {
        fprintf(stderr, "usage: see the beginning of ranges.c\n");
        return 2;
    }
    identity = argv[2];
    states = strtoul(argv[3], NULL, 10);
    indicators = strtoul(argv[4], NULL, 10);
    read_file(argv[5]);
    state = strtoull(argv[7], NULL, 10);
    part = strcmp(argv[8], "part") == 0;
#if FMI == 3
    events_by_host = 1;
#endif
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library || states > MOST || indicators > MOST) {
        fprintf(stderr, "error: %s\n", library ? "too many states" : dlerror());
        return 2;
    }
    for (int i = 0; i < count; i++) {
        if (variables[i].causality != '-')
            settable[n++] = &variables[i];
        if (variables[i].causality == 'i' && !known)
            known = variables[i].reference;
    }
    unknown = references[0][0]; /* outputs come first */
    for (int scene = 0; scene < scenes; scene++)
        for (int i = 0; i < n; i++)
            for (int k = 0; k < 3; k++) {
                struct trial trial = {settable[i], settable[i]->value[k]};
                if (part && (k == 1 ? i > 0 : (scene + i + k / 2) % (scenes + 1) != FMI % 2))
                    continue;
                run(allowed, scene, &trial, 1);
            }
    for (int k = strtol(argv[6], NULL, 10); k > 0; k--) {
        struct trial trials[2];
        for (int i = 0; i < 2; i++) {
            trials[i].variable = settable[below(n)];
            trials[i].value = any_value(trials[i].variable);
        }
        run(allowed, below(scenes), trials, 2);
    }
    for (int i = 0; i < n; i++)
        for (size_t k = 0; k < sizeof none / sizeof *none && settable[i]->type == 'R'; k++) {
            struct trial trial = {settable[i], none[k]};
            if (part && (int)k != ((i + FMI) % 2 ? i % 3 : 3 + i / 2 % 2))
                continue;
            run(forbidden, 0, &trial, 1);
        }
    printf("%d runs, %d refused, %d with no number, %d faults\n", runs, refused, others, ended);
    return ended > 0;
}
