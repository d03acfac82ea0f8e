/* A C host that measures the stack that an FMU needs. An instance is made, stepped and freed in a thread whose stack
 * is filled with a pattern; overwritten bytes were used. Prints two numbers of bytes: to instantiate and initialise,
 * and for the steps.
 *
 *   stack LIBRARY IDENTITY co-simulation|model-exchange STATES [TYPE:REFERENCE=VALUE...] -- REFERENCE...
 *
 * The references after -- are those of all Reals, which are read. */
#define _GNU_SOURCE
#include "fmi.h"
#include <pthread.h>
#include <sys/mman.h>

enum { SIZE = 8 << 20, MOST = 4000, PATTERN = 0xa5 };

static int argument_count, kind;
static char **arguments;
static Reference reals[MOST];
static size_t count, states;
static unsigned char *stack;
static Instance c;

static void set_all(void)
{
    int i = 5;
    for (; i < argument_count && strcmp(arguments[i], "--") != 0; i++) {
        char type;
        Reference reference;
        double value;
        if (sscanf(arguments[i], "%c:%u=%lf", &type, &reference, &value) != 3)
            fail("a setting is not TYPE:REFERENCE=VALUE");
        MUST(set_value(c, type, reference, value));
    }
    for (i++; i < argument_count && count < MOST; i++)
        reals[count++] = (Reference)strtoul(arguments[i], NULL, 10);
}

static void *begin(void *nothing)
{
    static double x[MOST];
    c = instantiate(kind);
    if (!c)
        fail("no instance");
    set_all();
    MUST(initialise(c, kind, 0, 0));
    MUST(get_reals(c, reals, count, x));
    return nothing;
}

static void *go_on(void *nothing)
{
    static double x[MOST], rate[MOST];
    if (kind == CO_SIMULATION) {
        for (int n = 0; n < 50; n++) {
            MUST(do_step(c, 0.02 * n, 0.02));
            MUST(get_reals(c, reals, count, x));
        }
    } else {
        int event;
        MUST(to_continuous_time(c));
        MUST(get_states(c, x, states));
        for (int n = 1; n <= 50; n++) {
            MUST(set_time(c, 1e-6 * n));
            MUST(set_states(c, x, states));
            MUST(get_rates(c, rate, states));
            MUST(completed_step(c, &event));
        }
        MUST(get_reals(c, reals, count, x));
    }
    return nothing;
}

static void *nothing(void *none) { return none; }

/* Runs a function in a new thread, and returns the number of bytes of the stack that it has used. */
static size_t used(void *(*function)(void *))
{
    pthread_attr_t attributes;
    pthread_t thread;
    size_t untouched = 0;
    memset(stack, PATTERN, SIZE);
    pthread_attr_init(&attributes);
    if (pthread_attr_setstack(&attributes, stack, SIZE) || pthread_create(&thread, &attributes, function, NULL) ||
        pthread_join(thread, NULL))
        fail("no thread");
    while (untouched < SIZE && stack[untouched] == PATTERN)
        untouched++;
    return SIZE - untouched;
}

int main(int argc, char **argv)
{
    size_t own, start, steps;
    if (argc < 5)
        return 2;
    argument_count = argc, arguments = argv;
    identity = argv[2];
    kind = strcmp(argv[3], "co-simulation") == 0 ? CO_SIMULATION : MODEL_EXCHANGE;
    states = strtoul(argv[4], NULL, 10);
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    stack = mmap(NULL, SIZE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (!library || stack == MAP_FAILED)
        fail(library ? "no memory" : dlerror());
    own = used(nothing); /* the thread library's share */
    start = used(begin);
    steps = used(go_on);
    printf("%zu bytes to start, %zu bytes to step\n", start - own, steps - own);
    return 0;
}
