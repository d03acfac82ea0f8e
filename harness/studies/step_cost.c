/* Host in which step_cost.py counts instructions: it makes STEPS communication steps of H seconds with any FMU 2.0.
 *
 *   step_cost LIBRARY GUID TOLERANCE STEPS H W0 W1 LONG [r REFERENCE VALUE | i REFERENCE VALUE | u REFERENCE SIZE]...
 *
 * Sets reals (r) and integers (i) before the start. Inputs (u) oscillate with the amplitude SIZE, linearly between communication
 * points, at an angular frequency that changes from W0 to W1, rad/s. With LONG > 0 a last step of LONG seconds follows.
 * Its status is not checked, because an FMU with bounded steps rejects it. */
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 8 };            /* inputs */

static void *library, *c;

static void check(const char *name, int status)
{
    if (status != 0) {
        fprintf(stderr, "%s answers %d\n", name, status);
        exit(1);
    }
}

/* sin of the phase after k steps */
static double swing(double w0, double w1, int steps, double h, int k)
{
    return sin(h * k * (w0 + 0.5 * (w1 - w0) * k / steps));
}

/* Calls fmi2NAME of the instance with arguments of these types. */
#define CALL(name, types, ...)                                                                             \
    check("fmi2" #name, ((int(*) types)dlsym(library, "fmi2" #name))__VA_ARGS__)

int main(int count, char **argv)
{
    const void *callbacks[5] = {NULL};
    unsigned inputs[MOST];
    double sizes[MOST], values[MOST], slopes[MOST];
    int orders[MOST];
    size_t n = 0;
    if (count < 9 || (count - 9) % 3)
        return fprintf(stderr, "usage: see the beginning of step_cost.c\n"), 1;
    library = dlopen(argv[1], RTLD_NOW);
    if (!library)
        return fprintf(stderr, "%s\n", dlerror()), 1;
    double tolerance = atof(argv[3]), h = atof(argv[5]), w0 = atof(argv[6]), w1 = atof(argv[7]), last = atof(argv[8]);
    int steps = atoi(argv[4]);
    void *(*instantiate)(const char *, int, const char *, const char *, const void *, int, int) =
        (void *(*)(const char *, int, const char *, const char *, const void *, int, int))dlsym(
            library, "fmi2Instantiate");
    c = instantiate("cost", 1, argv[2], "", callbacks, 0, 0);
    if (!c)
        return fprintf(stderr, "no instance\n"), 1;
    for (int k = 9; k < count; k += 3) {
        unsigned reference = (unsigned)atoi(argv[k + 1]);
        double x = atof(argv[k + 2]);
        int i = atoi(argv[k + 2]);
        if (*argv[k] == 'r')
            CALL(SetReal, (void *, const unsigned *, size_t, const double *), (c, &reference, 1, &x));
        else if (*argv[k] == 'i')
            CALL(SetInteger, (void *, const unsigned *, size_t, const int *), (c, &reference, 1, &i));
        else if (n < MOST)
            inputs[n] = reference, sizes[n] = x, orders[n] = 1, n++;
    }
    CALL(SetupExperiment, (void *, int, double, double, int, double), (c, 1, tolerance, 0, 0, 0));
    CALL(EnterInitializationMode, (void *), (c));
    CALL(ExitInitializationMode, (void *), (c));
    for (int k = 0; k < steps; k++) {
        double now = swing(w0, w1, steps, h, k), then = swing(w0, w1, steps, h, k + 1);
        for (size_t i = 0; i < n; i++) {
            values[i] = sizes[i] * now;
            slopes[i] = sizes[i] * (then - now) / h;
        }
        CALL(SetReal, (void *, const unsigned *, size_t, const double *), (c, inputs, n, values));
        CALL(SetRealInputDerivatives,
             (void *, const unsigned *, size_t, const int *, const double *),
             (c, inputs, n, orders, slopes));
        CALL(DoStep, (void *, double, double, int), (c, k * h, h, 1));
    }
    if (last > 0)
        ((int (*)(void *, double, double, int))dlsym(library, "fmi2DoStep"))(c, steps * h, last, 1);
    return 0;
}
