/* The hostile host: see host.c. */
#include <stddef.h>
#include <stdint.h>

/* A call that takes more CPU time than this is a failure, s. Time on the clock would accuse calls
 * that only waited for their turn on a busy machine. */
extern double host_slowest_allowed;

/* What happened so far, over all inputs. */
extern struct host_report {
    unsigned long inputs, calls, accepted, errors, messages;
    /* of a single call, CPU time, s */
    double slowest;
    const char *slowest_call;
} host_report;

/* What the host knows of the FMU that it is linked with. */
struct host_fmu {
    /* of FMI 2.0; the token of FMI 3.0 */
    const char *guid, *token;
    /* scalar variables; the first of them are the outputs, reals. Where the token is that of the FMU 3.0 with arrays: its variables,
     * and 0 outputs */
    size_t variables, outputs;
    size_t states, indicators;
    /* the value reference in FMI 3.0 of the first of three inputs at least, reals */
    size_t inputs;
};

/* Turns the bytes into calls of the FMU; aborts with a sentence on what must not
 * happen. */
void host_run(const struct host_fmu *fmu, const uint8_t *data, size_t size);
