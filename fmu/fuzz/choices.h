/* Functions of the hostile host that do not depend on the version of FMI; see host.c. */
#include "host.h"

/* Largest number of calls per input. */
#define CALLS 100
#define SLOTS 4
#define MAX_OUTPUTS 64

/* Status of a call; the numbers are the same in every version. */
enum { HOST_OK = 0, HOST_DISCARD = 2, HOST_ERROR = 3, HOST_FATAL = 4 };

/* Functions for one version: `start` creates an instance, `call` makes one call or several related calls, `end` frees everything. */
struct host_version {
    void (*start)(void), (*call)(void), (*end)(void);
};
extern const struct host_version host_fmi2, host_fmi3;

/* ---- Data of the host ---- */

extern const struct host_fmu *fmu;
extern void *instances[SLOTS];
extern void *states[SLOTS];
extern struct host_saved { char *bytes; size_t size; } saved[SLOTS];
/* Memory for handles that are valid addresses, but neither an instance nor a state. */
extern uint64_t nothing[8];

void fail(const char *what);

/* ---- Choices, which the bytes of the input determine ---- */

unsigned byte(void);
int one_in(unsigned n);
uint64_t word(void);
double real(void);
int integer(void);
size_t length(void);
const char *text(void);
int slot(void);
void *instance(void);
void *state(void);

/* Returns an array of n elements, which the next `done` frees, or sometimes NULL. */
void *array(size_t n, size_t size);
double *reals(size_t n);
int *integers(size_t n);
unsigned *references(size_t n);
const char **texts(size_t n);

/* ---- Calls ---- */

void begin(const char *name);
void timed(void);
int done(int status);
/* Makes a call and checks it. Its arguments are chosen before the time measurement starts. */
#define CALL(name, ...) (begin(#name), done((int)name(__VA_ARGS__)))

/* Returns the step size h, or 1 s if h is longer and there was a longer step before. */
double shortened(double h);
/* Checks that a log message has a text and a category. */
void judge_message(int status, const char *category, const char *message);
/* Checks that all outputs are finite after a successful step. `first` is the value reference of the first output; the others follow. */
void check_outputs(unsigned first, int (*read)(void *, const unsigned *, size_t, double *), void *c);

/* For calls within a call: data of the outer call, whose checks are suspended. */
struct host_call { const char *name; int offers_extreme, raised; };
struct host_call suspend(void);
void resume(struct host_call outer);
