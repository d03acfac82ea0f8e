/* A C host with a floating-point environment of its own: another rounding mode, or subnormal numbers taken for 0.
 * It sets some variables, makes 500 steps of 20 ms and prints the bits of all Reals after every fifty.
 *
 *   rounding LIBRARY GUID MODE TYPE:REFERENCE=VALUE... -- REFERENCE...
 *
 * MODE is nearest, up, down, zero or flush; TYPE R, I or B; the references after -- are those of the Reals. */
#include <dlfcn.h>
#include <fenv.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "fmi2Functions.h"

#define CALL(name) ((name##TYPE *)dlsym(library, #name))
#define MUST(call)                                                         \
    do {                                                                   \
        if ((call) != fmi2OK) {                                            \
            fprintf(stderr, "error: %s is not fmi2OK\n", #call);           \
            return 2;                                                      \
        }                                                                  \
    } while (0)

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String format, ...)
{
    (void)environment, (void)name, (void)status, (void)category, (void)format;
}

static int set_mode(const char *mode)
{
    if (strcmp(mode, "flush") == 0) {
#if defined(__x86_64__)
        _mm_setcsr(_mm_getcsr() | 0x8040); /* results and operands */
#endif
        return 0;
    }
    return fesetround(strcmp(mode, "up") == 0     ? FE_UPWARD
                      : strcmp(mode, "down") == 0 ? FE_DOWNWARD
                      : strcmp(mode, "zero") == 0 ? FE_TOWARDZERO
                                                  : FE_TONEAREST);
}

int main(int argc, char **argv)
{
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    void *library = argc > 4 ? dlopen(argv[1], RTLD_NOW | RTLD_LOCAL) : NULL;
    double values[100];
    int arg = 4;
    fmi2Component c;
    if (!library)
        return 2;
    /* the host's numbers are read before it changes how numbers are rounded */
    for (int i = arg; i < argc && i - arg < 100 && strcmp(argv[i], "--") != 0; i++)
        values[i - arg] = strtod(strchr(argv[i], '=') + 1, NULL);
    if (set_mode(argv[3]) != 0)
        return 2;
    c = CALL(fmi2Instantiate)("one", fmi2CoSimulation, argv[2], "file:///nowhere", &callbacks, fmi2False, fmi2False);
    if (!c)
        return 2;
    for (; arg < argc && strcmp(argv[arg], "--") != 0; arg++) {
        fmi2ValueReference reference = (fmi2ValueReference)strtoul(argv[arg] + 2, NULL, 10);
        double value = values[arg - 4];
        int integer = (int)value;
        if (argv[arg][0] == 'R')
            MUST(CALL(fmi2SetReal)(c, &reference, 1, &value));
        else if (argv[arg][0] == 'I')
            MUST(CALL(fmi2SetInteger)(c, &reference, 1, &integer));
        else
            MUST(CALL(fmi2SetBoolean)(c, &reference, 1, &integer));
    }
    MUST(CALL(fmi2SetupExperiment)(c, fmi2False, 0, 0, fmi2False, 0));
    MUST(CALL(fmi2EnterInitializationMode)(c));
    MUST(CALL(fmi2ExitInitializationMode)(c));
    for (int n = 1; n <= 500; n++) {
        MUST(CALL(fmi2DoStep)(c, 0.02 * (n - 1), 0.02, fmi2True));
        for (int i = arg + 1; i < argc && n % 50 == 0; i++) {
            fmi2ValueReference reference = (fmi2ValueReference)strtoul(argv[i], NULL, 10);
            uint64_t bits;
            double x;
            MUST(CALL(fmi2GetReal)(c, &reference, 1, &x));
            memcpy(&bits, &x, sizeof bits);
            printf("%" PRIx64 "\n", bits);
        }
    }
    return 0;
}
