/* Interface of the hostile host; see host.c. */
#include <stddef.h>
#include <stdint.h>

/* Largest CPU time of a call, s. Elapsed time is not used, because on a busy machine calls also wait for the processor. */
extern double host_slowest_allowed;

/* Numbers of inputs, calls, accepted calls, errors and messages so far. */
extern struct host_report {
    unsigned long inputs, calls, accepted, errors, messages;
    /* CPU time of the slowest call, s */
    double slowest;
    const char *slowest_call;
} host_report;

/* Data about the FMU with which the host is linked. */
struct host_fmu {
    /* GUID (FMI 2.0) and instantiationToken (FMI 3.0) */
    const char *guid, *token;
    /* numbers of scalar variables and of outputs, which are the first variables and are reals. If the token belongs to the
     * FMI 3.0 description with arrays, `variables` is the number of its variables, and `outputs` is 0. */
    size_t variables, outputs;
    size_t states, indicators;
    /* value reference in FMI 3.0 of the first input; there are at least three inputs, which are reals */
    size_t inputs;
};

/* Turns the bytes into calls of the FMU. If the FMU violates a rule, aborts with a message about this rule. */
void host_run(const struct host_fmu *fmu, const uint8_t *data, size_t size);
