/* A C host that uses the packed FMU's binary in every way: both interfaces, saved states, many instances at the same
 * time, loading and unloading. It is compiled for FMI 2.0 or FMI 3.0 (fmi.h). The program ends with a sentence about
 * the first fault. It does not leak memory itself, so that valgrind counts only leaks of the FMU.
 *
 *   life LIBRARY GUID INSTANCES LOADS OMEGA OMEGA_DOT TAU_CMD SLOSH_MODEL INIT_OMEGA [INDICATOR]
 *
 * INDICATOR is the value reference of the first event indicator, because event indicators are variables in FMI 3.0. */
#define _GNU_SOURCE
#include "fmi.h"

/* value references from the model description */
static Reference omega, omega_dot, tau_cmd, slosh_model, init_omega, indicator;

/* ---- Memory ---- */

static unsigned long allocations;
#ifdef COUNT_ALLOCATIONS
/* The allocator of the process. The FMU's library finds these functions before those of the C library. */
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *__libc_memalign(size_t, size_t);

void *malloc(size_t size) { allocations++; return __libc_malloc(size); }
void *calloc(size_t n, size_t size) { allocations++; return __libc_calloc(n, size); }
void *realloc(void *old, size_t size) { allocations++; return __libc_realloc(old, size); }
void *aligned_alloc(size_t alignment, size_t size) { allocations++; return __libc_memalign(alignment, size); }
int posix_memalign(void **made, size_t alignment, size_t size)
{
    allocations++;
    *made = __libc_memalign(alignment, size);
    return *made ? 0 : 12;
}
#endif

/* ---- Loading ---- */

static void load(const char *path) {
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        fail(dlerror());
}

/* Returns true if the process still maps the library. */
static int is_mapped(const char *path) {
    FILE *maps = fopen("/proc/self/maps", "r");
    char line[4096];
    int found = 0;
    while (maps && fgets(line, sizeof line, maps))
        found |= strstr(line, path) != NULL;
    if (maps)
        fclose(maps);
    return found;
}

static void unload(const char *path) {
    if (dlclose(library))
        fail(dlerror());
    if (is_mapped(path))
        fail("the library is still there after it was unloaded");
}

/* Returns the memory of the process in kilobytes. */
static long memory(void) {
    FILE *file = fopen("/proc/self/statm", "r");
    long all = 0, resident = 0;
    if (!file || fscanf(file, "%ld %ld", &all, &resident) != 2)
        fail("/proc/self/statm cannot be read");
    fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

/* Returns the number of open file descriptors. */
static int descriptors(void) {
    int n = 0;
    for (int fd = 0; fd < 1024; fd++)
        n += lseek(fd, 0, SEEK_CUR) != -1 || isatty(fd);
    return n;
}

/* ---- Life ---- */

static Instance begin(int kind, int model) {
    Instance c = instantiate(kind);
    if (!c)
        fail("no instance");
    MUST(set_value(c, 'E', slosh_model, model));
    MUST(set_value(c, 'R', init_omega, 0.003)); /* it comes to rest, and breaks away again */
    MUST(initialise(c, kind, 1e-8, 100));
    return c;
}

static double step(Instance c, double t, double torque) {
    double rate;
    MUST(set_value(c, 'R', tau_cmd, torque));
    MUST(ramp(c, tau_cmd, t, 0.01));
    MUST(do_step(c, t, 0.1));
    MUST(get_reals(c, &omega, 1, &rate));
    return rate;
}

static void co_simulation(int model) {
    messages = 0;
    unsigned long before = allocations;
    Instance c = begin(CO_SIMULATION, model);
    double rate, slope, answer;
#ifdef COUNT_ALLOCATIONS
    if (allocations == before)
        fail("the FMU's memory is not counted");
#endif
    step(c, 0, 0.02);
    before = allocations;
    for (int n = 1; n < 10; n++) {
        step(c, 0.1 * n, 0.02 * (n % 3 - 1));
        MUST(output_derivative(c, omega, &slope));
    }
    if (allocations != before)
        fail("steps take memory");
    if (messages != 0)
        fail("an ordinary run says something");
    MUST(log_everything(c));
    /* saves a state and restores it, as a handle and as bytes */
    State state = NULL, read = NULL;
    size_t size = 0;
    MUST(save(c, &state));
    MUST(state_size(c, state, &size));
    char *bytes = malloc(size);
    MUST(serialise(c, state, bytes, size));
    double first = step(c, 1.0, 0.05);
    MUST(restore(c, state));
    double second = step(c, 1.0, 0.05);
    MUST(deserialise(c, bytes, size, &read));
    MUST(restore(c, read));
    double third = step(c, 1.0, 0.05);
    if (first != second || first != third)
        fail("a state that was set back gives another motion");
    MUST(save(c, &state));
    MUST(free_state(c, &state));
    MUST(free_state(c, &read));
    free(bytes);
    MUST(derivative(c, omega_dot, tau_cmd, &answer));
    /* Wrong calls must be refused with a message. In FMI 3.0 they end the simulation. */
    if (do_step(c, 1.1, -1.0) != ERROR || get_reals(c, NULL, 1, NULL) != ERROR)
        fail("a call that makes no sense was accepted");
    MUST(get_reals(c, &omega, 1, &rate));
    if (terminate(c) != (FMI == 2 ? OK : ERROR))
        fail("an error ends the simulation in FMI 3.0, and in FMI 2.0 it does not");
    MUST(reset(c));
    free_instance(c);
}

/* Reads the event indicators, none of which may be 0 after an event. Read as variables, they must have the same values. */
static void indicators_after_an_event(Instance c, double *z) {
    MUST(get_indicators(c, z, INDICATORS));
    for (Reference i = 0; i < INDICATORS; i++) {
        Reference reference = indicator + i;
        double variable;
        if (z[i] == 0)
            fail("an event indicator is 0 after event mode");
        if (FMI == 3 && (get_reals(c, &reference, 1, &variable) != OK || variable != z[i]))
            fail("an event indicator is another as a variable");
    }
}

static void model_exchange(int model) {
    /* The compiler's command line defines STATES and INDICATORS. */
    Instance c = begin(MODEL_EXCHANGE, model);
    double x[STATES], rates[STATES], indicators[INDICATORS], before[INDICATORS];
    unsigned long at_first;
    MUST(to_continuous_time(c));
    indicators_after_an_event(c, before);
    at_first = allocations;
    for (int n = 1; n <= 2000; n++) {
        MUST(get_states(c, x, STATES));
        MUST(get_rates(c, rates, STATES));
        for (int i = 0; i < STATES; i++)
            x[i] += 1e-3 * rates[i];
        MUST(set_time(c, 1e-3 * n));
        MUST(set_states(c, x, STATES));
        MUST(get_indicators(c, indicators, INDICATORS));
        int event = 0;
        MUST(completed_step(c, &event));
        for (int i = 0; i < INDICATORS; i++)
            event |= (indicators[i] > 0) != (before[i] > 0);
        if (event) {
            MUST(enter_event_mode(c));
            MUST(set_value(c, 'R', tau_cmd, 0.02 * (n % 5 - 2)));
            MUST(to_continuous_time(c));
            indicators_after_an_event(c, indicators);
        }
        memcpy(before, indicators, sizeof before);
    }
    if (allocations != at_first)
        fail("Model Exchange takes memory");
    MUST(terminate(c));
    free_instance(c);
}

/* Steps many instances in turns. Each must have the results that it has by itself. */
static void many(int count) {
    Instance *all = malloc((size_t)count * sizeof *all);
    double alone[5][3];
    for (int model = 0; model < 5; model++) {
        Instance c = begin(CO_SIMULATION, model + 1);
        for (int n = 0; n < 3; n++)
            alone[model][n] = step(c, 0.1 * n, 0.03);
        free_instance(c);
    }
    for (int i = 0; i < count; i++)
        all[i] = begin(CO_SIMULATION, i % 5 + 1);
    for (int n = 0; n < 3; n++)
        for (int i = 0; i < count; i++)
            if (step(all[i], 0.1 * n, 0.03) != alone[i % 5][n])
                fail("an instance among many moves otherwise than alone");
    for (int i = 0; i < count; i++)
        free_instance(all[i]);
    free(all);
}

int main(int count, char **arguments) {
    if (count != 10 && count != 11) {
        fprintf(stderr, "usage: see the beginning of life.c\n");
        return 2;
    }
    const char *path = arguments[1];
    identity = arguments[2];
    int instances = atoi(arguments[3]), loads = atoi(arguments[4]);
    Reference *references[] = {&omega, &omega_dot, &tau_cmd, &slosh_model, &init_omega, &indicator};
    for (int i = 0; i < count - 5; i++)
        *references[i] = (Reference)strtoul(arguments[5 + i], NULL, 10);
#if FMI == 3
    movable[movable_count++] = tau_cmd;
    events_by_host = 1;
#endif

    load(path);
    for (int model = 1; model <= 5; model++) {
        co_simulation(model);
        model_exchange(model);
    }
#if FMI == 3
    if (early_returns == 0)
        fail("no step returned early");
    /* From here on the FMU handles events within its steps. */
    events_by_host = 0;
#endif
    many(instances);
    unload(path);

    /* The first loads fill caches of the dynamic linker and of malloc. */
    long at_first = 0;
    int open_at_first = 0;
    for (int n = 0; n < loads; n++) {
        load(path);
        Instance c = begin(CO_SIMULATION, n % 5 + 1);
        step(c, 0.0, 0.03);
        /* A panic hook or a thread's destructor that was left behind would point to code that is no longer loaded. */
        if (do_step(c, NAN, 1.0) != ERROR)
            fail("a call that makes no sense was accepted");
        free_instance(c);
        unload(path);
        if (n == loads / 10) {
            at_first = memory();
            open_at_first = descriptors();
        }
    }
    printf("%d instances at once, loaded %d times, %ld KiB more memory since then, %d more descriptors, "
           "%lu messages\n",
           instances, loads + 1, memory() - at_first, descriptors() - open_at_first, messages);
    return 0;
}
