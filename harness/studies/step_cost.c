/* How many instructions one fmi2DoStep takes: median, 99.99th percentile and maximum over a sweep.
 *
 *   step_cost LIBRARY GUID STEPS H AMPLITUDE TORQUE [REFERENCE TYPE VALUE]...
 *
 * H in s, AMPLITUDE in N.m, TORQUE the value reference of the input; TYPE is r, i or b. The sweep goes
 * from 1.25 to 3.5 Hz in STEPS steps, in straight lines between communication points. Prints
 * "median p99.99 maximum" or why there is none.
 *
 * Instructions are counted by single steps of the processor (ptrace), which every Linux has, unlike
 * counters of the hardware; that takes microseconds per instruction. So all steps are timed first,
 * each by the least of five runs from the same saved state, and the slowest are counted, and some
 * from the middle. The functions' types are the official headers'. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "fmi2Functions.h"

enum { RUNS = 5, MIDDLE = 9 };

static void *library;
#define CALL(name) ((name##TYPE *)dlsym(library, #name))

static fmi2DoStepTYPE *do_step;
static fmi2Component c;
static double h;

static void fail(const char *what)
{
    printf("%s\n", what);
    exit(1);
}

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String format, ...)
{
    (void)environment, (void)name, (void)status, (void)category, (void)format;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Instructions of a child that makes `steps` (0 or 1) steps from here and ends. */
static long traced(double t, int steps)
{
    int status;
    long count = 0;
    pid_t child = fork();
    if (child == 0) {
        ptrace(PTRACE_TRACEME, 0, NULL, NULL);
        raise(SIGSTOP);
        if (steps)
            do_step(c, t, h, fmi2True);
        _exit(0);
    }
    if (child < 0 || waitpid(child, &status, 0) != child || !WIFSTOPPED(status))
        fail("this machine does not let a process trace its child");
    for (;; count++) {
        if (ptrace(PTRACE_SINGLESTEP, child, NULL, NULL) != 0 || waitpid(child, &status, 0) != child)
            fail("the child could not be traced");
        if (WIFEXITED(status))
            return count;
    }
}

static long instructions(double t) { return traced(t, 1) - traced(t, 0); }

/* Sets the input for the step that begins at t. */
static void drive(fmi2ValueReference torque, double amplitude, double t, double end)
{
    const double rate = log(3.5 / 1.25) / end;
    const double at[] = {t, t + h};
    double tau[2], slope;
    int order = 1;
    for (int i = 0; i < 2; i++)
        tau[i] = amplitude * sin(2 * M_PI * 1.25 * expm1(rate * at[i]) / rate);
    slope = (tau[1] - tau[0]) / h;
    CALL(fmi2SetReal)(c, &torque, 1, &tau[0]);
    CALL(fmi2SetRealInputDerivatives)(c, &torque, 1, &order, &slope);
}

static double *took;

static int by_time(const void *a, const void *b)
{
    double x = took[*(const int *)a], y = took[*(const int *)b];
    return (x > y) - (x < y);
}

static int by_size(const void *a, const void *b)
{
    long x = *(const long *)a, y = *(const long *)b;
    return (x > y) - (x < y);
}

int main(int count, char **argv)
{
    if (count < 7 || (count - 7) % 3)
        fail("usage: see the beginning of step_cost.c");
    library = dlopen(argv[1], RTLD_NOW);
    if (!library)
        fail(dlerror());
    do_step = CALL(fmi2DoStep);
    int steps = atoi(argv[3]);
    double amplitude = atof(argv[5]);
    fmi2ValueReference torque = (fmi2ValueReference)atoi(argv[6]);
    h = atof(argv[4]);
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    c = CALL(fmi2Instantiate)("cost", fmi2CoSimulation, argv[2], "", &callbacks, fmi2False, fmi2False);
    if (!c)
        fail("no instance");
    for (int i = 7; i < count; i += 3) {
        fmi2ValueReference reference = (fmi2ValueReference)atoi(argv[i]);
        double x = atof(argv[i + 2]);
        int n = atoi(argv[i + 2]);
        fmi2Status status = *argv[i + 1] == 'r'   ? CALL(fmi2SetReal)(c, &reference, 1, &x)
                            : *argv[i + 1] == 'b' ? CALL(fmi2SetBoolean)(c, &reference, 1, &n)
                                                  : CALL(fmi2SetInteger)(c, &reference, 1, &n);
        if (status != fmi2OK)
            fail("a parameter was refused");
    }
    CALL(fmi2SetupExperiment)(c, fmi2True, 1e-4, 0, fmi2False, 0);
    CALL(fmi2EnterInitializationMode)(c);
    if (CALL(fmi2ExitInitializationMode)(c) != fmi2OK)
        fail("the start was refused");

    took = malloc((size_t)steps * sizeof *took);
    int *order = malloc((size_t)steps * sizeof *order);
    char *chosen = calloc((size_t)steps, 1);
    fmi2FMUstate first = NULL, here = NULL;
    if (!took || !order || !chosen || CALL(fmi2GetFMUstate)(c, &first) != fmi2OK)
        fail("no memory");
    /* The slowest 1.5 in 10,000, by time: among them are those above the percentile, by count. */
    int rank = steps / 10000, slow = 2 * rank + 10, middle = steps / 2 - MIDDLE / 2;
    for (int k = 0; k < steps; k++) {
        order[k] = k;
        took[k] = INFINITY;
        drive(torque, amplitude, k * h, steps * h);
        CALL(fmi2GetFMUstate)(c, &here);
        for (int run = 0; run < RUNS; run++) {
            CALL(fmi2SetFMUstate)(c, here);
            double start = now();
            if (do_step(c, k * h, h, fmi2True) != fmi2OK)
                fail("a step was refused");
            took[k] = fmin(took[k], now() - start);
        }
    }
    qsort(order, (size_t)steps, sizeof *order, by_time);
    for (int i = 0; i < slow; i++)
        chosen[order[steps - 1 - i]] = 1;
    for (int i = 0; i < MIDDLE; i++)
        chosen[order[middle + i]] |= 2;
    long *slowest = calloc((size_t)slow, sizeof *slowest), median[MIDDLE];
    int slowest_count = 0, median_count = 0;
    CALL(fmi2SetFMUstate)(c, first);
    for (int k = 0; k < steps; k++) {
        drive(torque, amplitude, k * h, steps * h);
        if (chosen[k]) {
            long n = instructions(k * h);
            if (chosen[k] & 1)
                slowest[slowest_count++] = n;
            if (chosen[k] & 2)
                median[median_count++] = n;
        }
        do_step(c, k * h, h, fmi2True);
    }
    qsort(slowest, (size_t)slowest_count, sizeof *slowest, by_size);
    qsort(median, (size_t)median_count, sizeof *median, by_size);
    printf("%ld %ld %ld\n", median[median_count / 2], slowest[slowest_count - 1 - rank],
           slowest[slowest_count - 1]);
    return 0;
}
