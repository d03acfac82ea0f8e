/* A C host that traps floating-point exceptions, as hosts do to find the first NaN: division by zero, invalid
 * operations and overflow end the process. It runs every slosh model with every friction law, with and without the
 * gyro, in both interfaces, each in a separate process, and prints a line for each run that a trap has ended. A model
 * may refuse a start.
 *
 *   traps LIBRARY GUID STATES INDICATORS SLOSH_MODELS FRICTION_MODELS all|part NAME=REFERENCE... -- REFERENCE...
 *
 * SLOSH_MODELS and FRICTION_MODELS are the numbers of items of the two enumerations. The names are those of
 * `variables` below; the references after -- are those of all Reals, which are read. With `part`, only every second
 * run is made, with fewer steps; the other runs are made with the other version of FMI (fmi.h), which handles events
 * itself if it can. */
#define _GNU_SOURCE
#include "fmi.h"
#include <signal.h>
#include <sys/wait.h>

/* Variables that the host sets, by name. Their value references come from the model description. */
enum {
    SLOSH, FRICTION, MODES, GYRO, WHEEL, LSB, OMEGA_0, ANGLE_0, RADIUS, COULOMB, STATIC,
    VISCOUS, STIFFNESS, TORQUE, GRAVITY, VARIABLES
};
static const char *const names[VARIABLES] = {
    "slosh.model", "friction.model", "slosh.modes", "imu.enabled", "wheel.enabled", "imu.lsb",
    "init.omega", "init.slosh_angle", "tank.r", "friction.c", "friction.d",
    "friction.b", "friction.sigma0", "tau_cmd", "g_axial",
};
static Reference variables[VARIABLES];

static size_t states, indicators;
static int part;
static Reference reals[1000];
static size_t count;

/* Start and inputs of a run, in addition to the models. Friction sticks up to 1.7 times the Coulomb torque. */
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

/* Ends the process with the kind of the exception. */
static void trapped(int signal, siginfo_t *info, void *context)
{
    (void)signal, (void)context;
    _exit(info->si_code == FPE_FLTDIV ? 10 : info->si_code == FPE_FLTOVF ? 11 : 12);
}

static void set(Instance c, char type, int variable, double value)
{
    MUST(set_value(c, type, variables[variable], value));
}

static void read_all(Instance c)
{
    static double x[1000];
    double answer;
    MUST(get_reals(c, reals, count, x));
    MUST(derivative(c, reals[0], variables[TORQUE], &answer)); /* the first Real is an output */
}

static double torque(const struct scene *scene, int step)
{
    if (scene->sine)
        return scene->torque * sin(0.05 * step);
    return step % 40 < 10 ? 0 : scene->torque * (step % 7 - 3) / 3;
}

static void stepping(Instance c, const struct scene *scene)
{
    double slope;
    for (int n = 0; n < (part ? 120 : 200); n++) { /* three or five rounds of steps and rest */
        set(c, 'R', TORQUE, torque(scene, n));
        MUST(do_step(c, 0.02 * n, 0.02));
        read_all(c);
        MUST(output_derivative(c, reals[0], &slope));
    }
}

enum { MOST = 1000 };

/* Makes one step of the classical Runge-Kutta method. Explicit Euler would make the fast slosh modes grow. */
static void runge_kutta(Instance c, double t, double h, double *x)
{
    static double k[4][MOST], there[MOST];
    static const double at[4] = {0, 0.5, 0.5, 1};
    MUST(get_states(c, x, states));
    for (int stage = 0; stage < 4; stage++) {
        for (size_t i = 0; i < states; i++)
            there[i] = x[i] + (stage ? h * at[stage] * k[stage - 1][i] : 0);
        MUST(set_time(c, t + h * at[stage]));
        MUST(set_states(c, there, states));
        MUST(get_rates(c, k[stage], states));
    }
    for (size_t i = 0; i < states; i++)
        x[i] += h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
    MUST(set_time(c, t + h));
    MUST(set_states(c, x, states));
}

static void exchange(Instance c, const struct scene *scene)
{
    static double x[MOST], z[MOST], before[MOST];
    const double h = 1e-3;
    if (states > MOST || indicators > MOST)
        _exit(2);
    MUST(to_continuous_time(c));
    MUST(get_indicators(c, before, indicators));
    for (int n = 1; n <= 1200; n++) {
        int event = 0;
        runge_kutta(c, h * (n - 1), h, x);
        MUST(get_indicators(c, z, indicators));
        MUST(completed_step(c, &event));
        for (size_t i = 0; i < indicators; i++)
            event |= (z[i] > 0) != (before[i] > 0);
        if (event || n % 20 == 0) {
            MUST(enter_event_mode(c));
            set(c, 'R', TORQUE, torque(scene, n / 20));
            MUST(to_continuous_time(c));
            MUST(get_indicators(c, z, indicators));
        }
        if (n % 10 == 0)
            read_all(c);
        memcpy(before, z, sizeof before);
    }
}

static void run(int kind, int slosh, int friction, int gyro, const struct scene *scene)
{
    struct sigaction action = {.sa_sigaction = trapped, .sa_flags = SA_SIGINFO};
    Instance c;
    sigaction(SIGFPE, &action, NULL);
    feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    shows_messages = 1;
    c = instantiate(kind);
    if (!c)
        _exit(2);
    set(c, 'E', SLOSH, slosh);
    set(c, 'E', FRICTION, friction);
    set(c, 'I', MODES, scene->modes);
    set(c, 'B', GYRO, gyro > 0);
    set(c, 'B', WHEEL, scene->wheel);
    set(c, 'R', LSB, gyro == 2 ? 1e-4 : 0);
    set(c, 'R', OMEGA_0, scene->omega);
    set(c, 'R', ANGLE_0, scene->angle);
    set(c, 'R', RADIUS, scene->radius);
    set(c, 'R', COULOMB, scene->coulomb);
    set(c, 'R', STATIC, 0.7 * scene->coulomb);
    set(c, 'R', VISCOUS, scene->viscous);
    set(c, 'R', GRAVITY, scene->gravity);
    if (kind == MODEL_EXCHANGE) /* bristles that an explicit method can follow */
        set(c, 'R', STIFFNESS, 1);
    if (initialise(c, kind, 0, 0) != OK)
        _exit(3); /* a scene that a model refuses */
    if (kind == CO_SIMULATION)
        stepping(c, scene);
    else
        exchange(c, scene);
    MUST(terminate(c));
    free_instance(c);
}

static void arguments(int argc, char **argv)
{
    int i = 8;
    identity = argv[2];
    states = strtoul(argv[3], NULL, 10);
    indicators = strtoul(argv[4], NULL, 10);
    for (; i < argc && strcmp(argv[i], "--") != 0; i++) {
        const char *value = strchr(argv[i], '=');
        for (int v = 0; value && v < VARIABLES; v++)
            if (strncmp(argv[i], names[v], (size_t)(value - argv[i])) == 0 &&
                names[v][value - argv[i]] == '\0')
                variables[v] = (Reference)strtoul(value + 1, NULL, 10);
    }
    for (i++; i < argc && count < sizeof reals / sizeof *reals; i++)
        reals[count++] = (Reference)strtoul(argv[i], NULL, 10);
}

int main(int argc, char **argv)
{
    int runs = 0, refused = 0, ended = 0;
    if (argc < 9) {
        fprintf(stderr, "usage: see the beginning of traps.c\n");
        return 2;
    }
    arguments(argc, argv);
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "error: %s\n", dlerror());
        return 2;
    }
#if FMI == 3
    events_by_host = 1;
#endif
    part = strcmp(argv[7], "part") == 0;
    for (int kind = 0; kind < KINDS; kind++)
        for (int slosh = 1; slosh <= atoi(argv[5]); slosh++)
            for (int friction = 1; friction <= atoi(argv[6]); friction++)
                for (int gyro = 0; gyro < 3; gyro++)
                    for (size_t n = 0; n < sizeof scenes / sizeof *scenes; n++) {
                        int status = 0, code;
                        pid_t child;
                        if (part && (kind + slosh + friction + gyro + (int)n) % 2 != FMI % 2)
                            continue;
                        fflush(stdout);
                        child = fork();
                        if (child == 0) {
                            run(kind, slosh, friction, gyro, &scenes[n]);
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
                               kind == CO_SIMULATION ? "Co-Simulation" : "Model Exchange",
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
