/* State of the process that an FMU shares with its host and must not change. */
#include <fenv.h>
#include <locale.h>
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#if defined(__x86_64__) || defined(_M_X64)
#include <xmmintrin.h>
#endif

/* Returns the rounding mode, the exception masks and the flushing of small numbers. The flags of past exceptions are
 * excluded, because every computation sets them. */
uint32_t hubslosh_float_control(void)
{
#if defined(__x86_64__) || defined(_M_X64)
    return _mm_getcsr() & ~0x3fu;
#else
    return (uint32_t)fegetround();
#endif
}

const char *hubslosh_locale(void)
{
    const char *name = setlocale(LC_ALL, NULL);
    return name ? name : "";
}

/* Returns an FNV-1a hash of the handlers of all signals. */
uint64_t hubslosh_signal_handlers(void)
{
    uint64_t hash = 0;
#if defined(__unix__) || defined(__APPLE__)
    int signal;
    hash = 14695981039346656037u;
    for (signal = 1; signal < 32; signal++) {
        struct sigaction action;
        if (sigaction(signal, NULL, &action) == 0)
            hash = (hash ^ (uint64_t)(uintptr_t)action.sa_handler) * 1099511628211u;
    }
#endif
    return hash;
}
