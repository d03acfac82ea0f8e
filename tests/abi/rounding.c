/* A C host with another floating-point environment: another rounding mode, or subnormal numbers treated as 0. It sets
 * some variables, makes STEPS steps of 20 ms, and prints the bits of all Reals after every tenth step.
 *
 *   rounding LIBRARY GUID MODE TYPE:REFERENCE=VALUE... -- REFERENCE...
 *
 * MODE is nearest, up, down, zero or flush; TYPE is R, I, E or B; the references after -- are those of the Reals. */
#define _GNU_SOURCE
#include "fmi.h"
#include <inttypes.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

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
    double values[100];
    int arg = 4;
    Instance c;
    if (argc <= 4)
        return 2;
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    identity = argv[2];
    if (!library)
        return 2;
    /* The numbers of the command line are parsed before the rounding mode changes. */
    for (int i = arg; i < argc && i - arg < 100 && strcmp(argv[i], "--") != 0; i++)
        values[i - arg] = strtod(strchr(argv[i], '=') + 1, NULL);
    if (set_mode(argv[3]) != 0)
        return 2;
#if FMI == 3
    events_by_host = 1;
#endif
    c = instantiate(CO_SIMULATION);
    if (!c)
        return 2;
    for (; arg < argc && strcmp(argv[arg], "--") != 0; arg++)
        MUST(set_value(c, argv[arg][0], (Reference)strtoul(argv[arg] + 2, NULL, 10), values[arg - 4]));
    MUST(initialise(c, CO_SIMULATION, 0, 0));
    for (int n = 1; n <= STEPS; n++) {
        MUST(do_step(c, 0.02 * (n - 1), 0.02));
        for (int i = arg + 1; i < argc && n % (STEPS / 10) == 0; i++) {
            Reference reference = (Reference)strtoul(argv[i], NULL, 10);
            uint64_t bits;
            double x;
            MUST(get_reals(c, &reference, 1, &x));
            memcpy(&bits, &x, sizeof bits);
            printf("%" PRIx64 "\n", bits);
        }
    }
    return 0;
}
