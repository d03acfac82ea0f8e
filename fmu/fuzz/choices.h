/* What the hostile host's calls of any version of FMI are made of: see host.c. */
#include "host.h"

/* Calls per input. */
#define CALLS 100
#define SLOTS 4
#define MAX_OUTPUTS 64

/* A call's status, the same numbers in every version. */
enum { HOST_OK = 0, HOST_DISCARD = 2, HOST_ERROR = 3, HOST_FATAL = 4 };

/* The calls of one version: an instance is made; one call, or several that belong together; everything is freed. */
struct host_version {
    void (*start)(void), (*call)(void), (*end)(void);
};
extern const struct host_version host_fmi2, host_fmi3;

/* ---- What the host has ---- */

extern const struct host_fmu *fmu;
extern void *instances[SLOTS];
extern void *states[SLOTS];
extern struct host_saved { char *bytes; size_t size; } saved[SLOTS];
/* No instance, no state: a handle that points to something all the same. */
extern uint64_t nothing[8];

void fail(const char *what);

/* ---- Choices, from the input's bytes ---- */

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

/* n elements that the next `done` frees; sometimes NULL. */
void *array(size_t n, size_t size);
double *reals(size_t n);
int *integers(size_t n);
unsigned *references(size_t n);
const char **texts(size_t n);

/* ---- Calls ---- */

void begin(const char *name);
void timed(void);
int done(int status);
/* Arguments are chosen before the clock starts. */
#define CALL(name, ...) (begin(#name), done((int)name(__VA_ARGS__)))

/* A step's length, less if there were long ones. */
double shortened(double h);
/* A message of the FMU is a text in a category. */
void judge_message(int status, const char *category, const char *message);
/* After a step that succeeded every output is a number; they are variables in a row from `first`. */
void check_outputs(unsigned first, int (*read)(void *, const unsigned *, size_t, double *), void *c);

/* Calls within a call: what is judged of the outer one waits. */
struct host_call { const char *name; int offers_extreme, raised; };
struct host_call suspend(void);
void resume(struct host_call outer);
