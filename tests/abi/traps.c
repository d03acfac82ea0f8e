/* A C host that traps floating-point exceptions, as hosts do that look for the first NaN: division by
 * zero, invalid operations and overflow end the process. Every slosh model with every friction law,
 * with and without the gyro, in both interfaces, each in a process of its own; one line for each that
 * a trap has ended. A start that a model refuses is no fault.
 *
 *   traps LIBRARY GUID STATES INDICATORS SLOSH_MODELS FRICTION_MODELS NAME=REFERENCE... -- REFERENCE...
 *
 * SLOSH_MODELS and FRICTION_MODELS are how many items the two enumerations have. The names are those of `variables` below; the references after -- are all Reals, which are read.
 * The functions' types are the official headers'. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fenv.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fmi2Functions.h"

/* What the host sets, by name; the value references come from the model description. */
enum {
    SLOSH, FRICTION, MODES, GYRO, WHEEL, LSB, OMEGA_0, ANGLE_0, RADIUS, COULOMB, STATIC,
    VISCOUS, STIFFNESS, TORQUE, GRAVITY, VARIABLES
};
static const char *const names[VARIABLES] = {
    "slosh.model", "friction.model", "slosh.modes", "imu.enabled", "wheel.enabled", "imu.lsb",
    "init.omega", "init.slosh_angle", "tank.r", "friction.c", "friction.d",
    "friction.b", "friction.sigma0", "tau_cmd", "g_axial",
};
static fmi2ValueReference variables[VARIABLES];

static const char *guid;
static size_t states, indicators;
static fmi2ValueReference reals[1000];
static size_t count;

/* What a run starts from and how it is driven, besides the models. The friction sticks up to
 * 1.7 coulomb. */
struct scene {
    const char *name;
    double omega, angle, radius, coulomb, viscous, gravity;
    int modes, wheel;
    double torque; /* amplitude, N.m */
    int sine;      /* slow, or steps with rest between */
};
static const struct scene scenes[] = {
    {"at rest", 0, 0, 0.225, 0.003498, 0.03793, 9.81, 1, 0, 0.15, 0},
    {"in motion, ten modes", 0.3, 0.2, 0.225, 0.003498, 0.03793, 9.81, 10, 0, 0.15, 0},
    {"with the wheel", -0.3, 0, 0.225, 0.003498, 0.03793, 9.81, 1, 1, 0.15, 0},
    {"tank on the axis", 0.3, 0.2, 0, 0.003498, 0.03793, 9.81, 2, 0, 0.15, 0},
    {"no friction torque", 0.3, 0.2, 0.225, 0, 0, 9.81, 1, 0, 0.15, 0},
    {"no gravity", 0, 0, 0.225, 0.003498, 0.03793, 0, 1, 0, 0.01, 1},
    {"stick and slip", 0, 0, 0.225, 0.003498, 0.03793, 9.81, 1, 0, 0.009, 1},
    {"stick and slip, three modes", 0.01, 0.02, 0.225, 0.003498, 0.03793, 9.81, 3, 0, 0.012, 1},
};
static const char *const gyro_names[] = {"no gyro", "gyro", "gyro, quantised"};

static void *library;
#define CALL(name) ((name##TYPE *)dlsym(library, #name))
#define MUST(call)                                                 \
    do {                                                           \
        if ((call) != fmi2OK) {                                    \
            fprintf(stderr, "error: %s is not fmi2OK\n", #call);   \
            _exit(2);                                              \
        }                                                          \
    } while (0)

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String format, ...)
{
    va_list list;
    (void)environment, (void)name, (void)status, (void)category;
    va_start(list, format);
    vfprintf(stderr, format, list);
    va_end(list);
    fputc('\n', stderr);
}

/* Ends the process with the kind of the exception. */
static void trapped(int signal, siginfo_t *info, void *context)
{
    (void)signal, (void)context;
    _exit(info->si_code == FPE_FLTDIV ? 10 : info->si_code == FPE_FLTOVF ? 11 : 12);
}

static void real(fmi2Component c, int variable, double x)
{
    MUST(CALL(fmi2SetReal)(c, &variables[variable], 1, &x));
}
static void integer(fmi2Component c, int variable, int x)
{
    MUST(CALL(fmi2SetInteger)(c, &variables[variable], 1, &x));
}
static void boolean(fmi2Component c, int variable, int x)
{
    MUST(CALL(fmi2SetBoolean)(c, &variables[variable], 1, &x));
}

static void read_all(fmi2Component c)
{
    static double x[1000];
    const double along = 1;
    double answer[1];
    MUST(CALL(fmi2GetReal)(c, reals, count, x));
    /* the first Real is an output */
    MUST(CALL(fmi2GetDirectionalDerivative)(c, reals, 1, &variables[TORQUE], 1, &along, answer));
}

static double torque(const struct scene *scene, int step)
{
    if (scene->sine)
        return scene->torque * sin(0.05 * step);
    return step % 40 < 10 ? 0 : scene->torque * (step % 7 - 3) / 3;
}

static void stepping(fmi2Component c, const struct scene *scene)
{
    const int order = 1;
    double slope;
    for (int n = 0; n < 300; n++) {
        real(c, TORQUE, torque(scene, n));
        MUST(CALL(fmi2DoStep)(c, 0.02 * n, 0.02, fmi2True));
        read_all(c);
        MUST(CALL(fmi2GetRealOutputDerivatives)(c, reals, 1, &order, &slope));
    }
}

static void events(fmi2Component c)
{
    fmi2EventInfo info;
    do
        MUST(CALL(fmi2NewDiscreteStates)(c, &info));
    while (info.newDiscreteStatesNeeded);
    MUST(CALL(fmi2EnterContinuousTimeMode)(c));
}

enum { MOST = 1000 };

/* One step of the classical method: explicit Euler would feed the fast slosh modes. */
static void runge_kutta(fmi2Component c, double t, double h, double *x)
{
    static double k[4][MOST], there[MOST];
    static const double at[4] = {0, 0.5, 0.5, 1};
    MUST(CALL(fmi2GetContinuousStates)(c, x, states));
    for (int stage = 0; stage < 4; stage++) {
        for (size_t i = 0; i < states; i++)
            there[i] = x[i] + (stage ? h * at[stage] * k[stage - 1][i] : 0);
        MUST(CALL(fmi2SetTime)(c, t + h * at[stage]));
        MUST(CALL(fmi2SetContinuousStates)(c, there, states));
        MUST(CALL(fmi2GetDerivatives)(c, k[stage], states));
    }
    for (size_t i = 0; i < states; i++)
        x[i] += h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
    MUST(CALL(fmi2SetTime)(c, t + h));
    MUST(CALL(fmi2SetContinuousStates)(c, x, states));
}

static void exchange(fmi2Component c, const struct scene *scene)
{
    static double x[MOST], z[MOST], before[MOST];
    const double h = 1e-3;
    if (states > MOST || indicators > MOST)
        _exit(2);
    events(c);
    MUST(CALL(fmi2GetEventIndicators)(c, before, indicators));
    for (int n = 1; n <= 2000; n++) {
        fmi2Boolean event = fmi2False, end = fmi2False;
        runge_kutta(c, h * (n - 1), h, x);
        MUST(CALL(fmi2GetEventIndicators)(c, z, indicators));
        MUST(CALL(fmi2CompletedIntegratorStep)(c, fmi2True, &event, &end));
        for (size_t i = 0; i < indicators; i++)
            event |= (z[i] > 0) != (before[i] > 0);
        if (event || n % 20 == 0) {
            MUST(CALL(fmi2EnterEventMode)(c));
            real(c, TORQUE, torque(scene, n / 20));
            events(c);
            MUST(CALL(fmi2GetEventIndicators)(c, z, indicators));
        }
        if (n % 10 == 0)
            read_all(c);
        memcpy(before, z, sizeof before);
    }
}

static void run(fmi2Type type, int slosh, int friction, int gyro, const struct scene *scene)
{
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    struct sigaction action = {.sa_sigaction = trapped, .sa_flags = SA_SIGINFO};
    fmi2Component c;
    sigaction(SIGFPE, &action, NULL);
    feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    c = CALL(fmi2Instantiate)("traps", type, guid, "file:///nowhere", &callbacks, fmi2False, fmi2True);
    if (!c)
        _exit(2);
    integer(c, SLOSH, slosh);
    integer(c, FRICTION, friction);
    integer(c, MODES, scene->modes);
    boolean(c, GYRO, gyro > 0);
    boolean(c, WHEEL, scene->wheel);
    real(c, LSB, gyro == 2 ? 1e-4 : 0);
    real(c, OMEGA_0, scene->omega);
    real(c, ANGLE_0, scene->angle);
    real(c, RADIUS, scene->radius);
    real(c, COULOMB, scene->coulomb);
    real(c, STATIC, 0.7 * scene->coulomb);
    real(c, VISCOUS, scene->viscous);
    real(c, GRAVITY, scene->gravity);
    if (type == fmi2ModelExchange) /* bristles that an explicit method can follow */
        real(c, STIFFNESS, 1);
    MUST(CALL(fmi2SetupExperiment)(c, fmi2False, 0, 0, fmi2False, 0));
    MUST(CALL(fmi2EnterInitializationMode)(c));
    if (CALL(fmi2ExitInitializationMode)(c) != fmi2OK)
        _exit(3); /* a scene that a model refuses */
    if (type == fmi2CoSimulation)
        stepping(c, scene);
    else
        exchange(c, scene);
    MUST(CALL(fmi2Terminate)(c));
    CALL(fmi2FreeInstance)(c);
}

static void arguments(int argc, char **argv)
{
    int i = 7;
    guid = argv[2];
    states = strtoul(argv[3], NULL, 10);
    indicators = strtoul(argv[4], NULL, 10);
    for (; i < argc && strcmp(argv[i], "--") != 0; i++) {
        const char *value = strchr(argv[i], '=');
        for (int v = 0; value && v < VARIABLES; v++)
            if (strncmp(argv[i], names[v], (size_t)(value - argv[i])) == 0 &&
                names[v][value - argv[i]] == '\0')
                variables[v] = (fmi2ValueReference)strtoul(value + 1, NULL, 10);
    }
    for (i++; i < argc && count < sizeof reals / sizeof *reals; i++)
        reals[count++] = (fmi2ValueReference)strtoul(argv[i], NULL, 10);
}

int main(int argc, char **argv)
{
    int runs = 0, refused = 0, ended = 0;
    if (argc < 8) {
        fprintf(stderr, "usage: see the beginning of traps.c\n");
        return 2;
    }
    arguments(argc, argv);
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "error: %s\n", dlerror());
        return 2;
    }
    for (int type = 0; type <= 1; type++)
        for (int slosh = 1; slosh <= atoi(argv[5]); slosh++)
            for (int friction = 1; friction <= atoi(argv[6]); friction++)
                for (int gyro = 0; gyro < 3; gyro++)
                    for (size_t n = 0; n < sizeof scenes / sizeof *scenes; n++) {
                        int status = 0, code;
                        pid_t child;
                        fflush(stdout);
                        child = fork();
                        if (child == 0) {
                            run(type, slosh, friction, gyro, &scenes[n]);
                            _exit(0);
                        }
                        if (child < 0 || waitpid(child, &status, 0) != child)
                            return 2;
                        runs++;
                        if (WIFEXITED(status) && WEXITSTATUS(status) == 3)
                            refused++;
                        if (WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 3))
                            continue;
                        ended++;
                        code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
                        printf("%s, slosh.model %d, friction.model %d, %s, %s: %s\n",
                               type == fmi2CoSimulation ? "Co-Simulation" : "Model Exchange",
                               slosh, friction, gyro_names[gyro], scenes[n].name,
                               code == 10   ? "division by zero"
                               : code == 11 ? "overflow"
                               : code == 12 ? "invalid operation"
                               : code == 2  ? "a call failed"
                                            : "the process ended");
                    }
    printf("%d runs, %d refused, %d ended by a trap\n", runs, refused, ended);
    return ended > 0;
}
