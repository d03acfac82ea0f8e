/* A small host that makes the FMI calls of a list to one FMU binary, and prints the bits of the results. Numbers are
 * passed as the hexadecimal digits of their bits, so that neither this program nor the C library of a platform computes
 * or converts numbers. harness/platforms/compare writes the list and plays the same list on every platform.
 *
 *   replay LIBRARY GUID < calls
 *   replay LIBRARY TOKEN INPUT... < calls         by the functions of FMI 3.0
 *
 * Calls, one a line (T, H, X: 16 hexadecimal digits of a double):
 *   real REFERENCE X | integer REFERENCE NUMBER | item REFERENCE NUMBER
 *                                                 set a variable; item: an enumeration
 *   slope REFERENCE X                             first derivative of an input (FMI 2.0)
 *   end REFERENCE X                               value of one of INPUT at the end of the next step,
 *                                                 set in intermediate update (FMI 3.0)
 *   outputs COUNT REFERENCE...                    variables that are read after each step
 *   start T                                       set up and initialise
 *   step T H                                      one step
 *   print NAME                                    bits of the outputs and hash of all outputs until now
 *   save FILE | load FILE                         serialised state */
#include <stdint.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
static void *opened(const char *path) { return (void *)LoadLibraryA(path); }
static void *named(void *library, const char *name)
{
    return (void *)GetProcAddress((HMODULE)library, name);
}
#else
#include <dlfcn.h>
static void *opened(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *named(void *library, const char *name) { return dlsym(library, name); }
#endif

enum { OK = 0, OUTPUTS = 64 };
typedef void *Component;

static const char *at = "start"; /* the line being played */

static void fail(const char *why)
{
    fprintf(stderr, "replay: %s (%s)\n", why, at);
    exit(1);
}

static void logger(void *environment, const char *instance, int status, const char *category,
                   const char *format, ...)
{
    va_list arguments;
    (void)environment;
    (void)instance;
    if (status == OK)
        return;
    fprintf(stderr, "%s: ", category);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

struct callbacks {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
};

static double number(const char *digits)
{
    uint64_t bits = strtoull(digits, NULL, 16);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static unsigned long long bits(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* FNV-1a over bytes */
static uint64_t hashed(uint64_t hash, const void *bytes, size_t count)
{
    const unsigned char *byte = bytes;
    while (count--)
        hash = (hash ^ *byte++) * UINT64_C(0x100000001b3);
    return hash;
}

static const uint64_t FRESH = UINT64_C(0xcbf29ce484222325);

/* The calls, by the names and types of FMI 2.0. */
static void *library;
static Component (*instantiate)(const char *, int, const char *, const char *, const struct callbacks *,
                                int, int);
static void (*free_instance)(Component);
static int (*setup)(Component, int, double, double, int, double);
static int (*enter)(Component), (*leave)(Component), (*terminate)(Component);
static int (*get_real)(Component, const uint32_t *, size_t, double *);
static int (*set_real)(Component, const uint32_t *, size_t, const double *);
static int (*set_integer)(Component, const uint32_t *, size_t, const int *);
static int (*set_item)(Component, const uint32_t *, size_t, const int *);
static int (*set_slope)(Component, const uint32_t *, size_t, const int *, const double *);
static int (*do_step)(Component, double, double, int);
static int (*get_state)(Component, void **), (*set_state)(Component, void *), (*free_state)(Component, void **);
static int (*state_size)(Component, void *, size_t *);
static int (*serialize)(Component, void *, char *, size_t);
static int (*deserialize)(Component, const char *, size_t, void **);

#define LOAD(variable, name)                                                                       \
    *(void **)&variable = named(library, name);                                                    \
    if (!variable)                                                                                 \
    fail("the binary lacks " name)

/* ---- FMI 3.0 under these names ---- */

enum { LINES = 16 };
static uint32_t inputs[LINES]; /* that move within steps */
static size_t inputs_count;
static struct {
    uint32_t input;
    double end;
} lines[LINES]; /* through the next step */
static size_t lines_count;
static double start;

static Component (*instantiate_3)(const char *, const char *, const char *, char, char, char, char,
                                  const uint32_t *, size_t, void *,
                                  void (*)(void *, int, const char *, const char *),
                                  void (*)(void *, double, char, char, char, char, char *, double *));
static int (*enter_3)(Component, char, double, double, char, double);
static int (*get_float64)(Component, const uint32_t *, size_t, double *, size_t);
static int (*set_float64)(Component, const uint32_t *, size_t, const double *, size_t);
static int (*set_int32)(Component, const uint32_t *, size_t, const int32_t *, size_t);
static int (*set_int64)(Component, const uint32_t *, size_t, const int64_t *, size_t);
static int (*do_step_3)(Component, double, double, char, char *, char *, char *, double *);

static void logger_3(void *environment, int status, const char *category, const char *message)
{
    (void)environment;
    if (status != OK)
        fprintf(stderr, "%s: %s\n", category, message);
}

static Component stepping;

static void update(void *environment, double time, char set_requested, char get_allowed, char finished,
                   char can_return, char *early_return, double *early_time)
{
    (void)environment, (void)get_allowed, (void)finished, (void)can_return;
    *early_return = 0;
    *early_time = time;
    for (size_t i = 0; set_requested && i < lines_count; i++) {
        if (set_float64(stepping, &lines[i].input, 1, &lines[i].end, 1) != OK)
            fail("an input is not set within the step");
    }
}

static Component instantiate_as_2(const char *name, int type, const char *token, const char *resources,
                                  const struct callbacks *callbacks, int visible, int logging)
{
    (void)type, (void)resources, (void)callbacks, (void)visible;
    return instantiate_3(name, token, NULL, 0, (char)logging, 0, 0, inputs, inputs_count, NULL, logger_3, update);
}

static int setup_as_2(Component c, int has_tolerance, double tolerance, double time, int has_stop, double stop)
{
    (void)c, (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    start = time;
    return OK;
}

static int enter_as_2(Component c) { return enter_3(c, 0, 0.0, start, 0, 0.0); }

static int get_as_2(Component c, const uint32_t *r, size_t n, double *x) { return get_float64(c, r, n, x, n); }

static int set_as_2(Component c, const uint32_t *r, size_t n, const double *x) { return set_float64(c, r, n, x, n); }

static int integer_as_2(Component c, const uint32_t *r, size_t n, const int *x)
{
    int32_t number = *x;
    return set_int32(c, r, n, &number, n);
}

static int item_as_2(Component c, const uint32_t *r, size_t n, const int *x)
{
    int64_t number = *x;
    return set_int64(c, r, n, &number, n);
}

static int step_as_2(Component c, double time, double step, int no_way_back)
{
    char event, end, early;
    double last;
    stepping = c;
    int status = do_step_3(c, time, step, (char)no_way_back, &event, &end, &early, &last);
    lines_count = 0;
    return event || end || early ? -1 : status;
}

static void load_2(void)
{
    LOAD(instantiate, "fmi2Instantiate");
    LOAD(free_instance, "fmi2FreeInstance");
    LOAD(setup, "fmi2SetupExperiment");
    LOAD(enter, "fmi2EnterInitializationMode");
    LOAD(leave, "fmi2ExitInitializationMode");
    LOAD(terminate, "fmi2Terminate");
    LOAD(get_real, "fmi2GetReal");
    LOAD(set_real, "fmi2SetReal");
    LOAD(set_integer, "fmi2SetInteger");
    set_item = set_integer;
    LOAD(set_slope, "fmi2SetRealInputDerivatives");
    LOAD(do_step, "fmi2DoStep");
    LOAD(get_state, "fmi2GetFMUstate");
    LOAD(set_state, "fmi2SetFMUstate");
    LOAD(free_state, "fmi2FreeFMUstate");
    LOAD(state_size, "fmi2SerializedFMUstateSize");
    LOAD(serialize, "fmi2SerializeFMUstate");
    LOAD(deserialize, "fmi2DeSerializeFMUstate");
}

static void load_3(void)
{
    LOAD(instantiate_3, "fmi3InstantiateCoSimulation");
    LOAD(free_instance, "fmi3FreeInstance");
    LOAD(enter_3, "fmi3EnterInitializationMode");
    LOAD(leave, "fmi3ExitInitializationMode");
    LOAD(terminate, "fmi3Terminate");
    LOAD(get_float64, "fmi3GetFloat64");
    LOAD(set_float64, "fmi3SetFloat64");
    LOAD(set_int32, "fmi3SetInt32");
    LOAD(set_int64, "fmi3SetInt64");
    LOAD(do_step_3, "fmi3DoStep");
    LOAD(get_state, "fmi3GetFMUState");
    LOAD(set_state, "fmi3SetFMUState");
    LOAD(free_state, "fmi3FreeFMUState");
    LOAD(state_size, "fmi3SerializedFMUStateSize");
    LOAD(serialize, "fmi3SerializeFMUState");
    LOAD(deserialize, "fmi3DeserializeFMUState");
    instantiate = instantiate_as_2;
    setup = setup_as_2;
    enter = enter_as_2;
    get_real = get_as_2;
    set_real = set_as_2;
    set_integer = integer_as_2;
    set_item = item_as_2;
    do_step = step_as_2;
}

#define MUST(call)                                                                                 \
    if ((call) != OK)                                                                              \
    fail("not OK: " #call)

int main(int count, char **arguments)
{
    static char line[4096], copy[4096];
    struct callbacks callbacks = {logger, calloc, free, NULL, NULL};
    uint32_t references[OUTPUTS];
    double outputs[OUTPUTS];
    size_t outputs_count = 0;
    uint64_t hash = FRESH;
    Component instance;

    if (count < 3 || count > 3 + LINES)
        fail("usage: see the beginning of replay.c");
    library = opened(arguments[1]);
    if (!library)
        fail("the binary cannot be loaded");
    for (int i = 3; i < count; i++)
        inputs[inputs_count++] = (uint32_t)strtoul(arguments[i], NULL, 10);
    if (inputs_count)
        load_3();
    else
        load_2();

    instance = instantiate("replay", 1, arguments[2], NULL, &callbacks, 0, 1);
    if (!instance)
        fail("no instance");

    while (fgets(line, sizeof line, stdin)) {
        char *words[OUTPUTS + 2];
        size_t n = 0;
        char *word;
        memcpy(copy, line, sizeof copy);
        copy[strcspn(copy, "\r\n")] = 0;
        at = copy;
        for (word = strtok(line, " \r\n"); word && n < OUTPUTS + 2; word = strtok(NULL, " \r\n"))
            words[n++] = word;
        if (n == 0)
            continue;
        const char *call = words[0];
        uint32_t reference = n > 1 ? (uint32_t)strtoul(words[1], NULL, 10) : 0;
        if (!strcmp(call, "real") && n == 3) {
            double value = number(words[2]);
            MUST(set_real(instance, &reference, 1, &value));
        } else if (!strcmp(call, "integer") && n == 3) {
            int value = atoi(words[2]);
            MUST(set_integer(instance, &reference, 1, &value));
        } else if (!strcmp(call, "item") && n == 3) {
            int value = atoi(words[2]);
            MUST(set_item(instance, &reference, 1, &value));
        } else if (!strcmp(call, "end") && n == 3 && lines_count < LINES) {
            lines[lines_count].input = reference;
            lines[lines_count++].end = number(words[2]);
        } else if (!strcmp(call, "slope") && n == 3 && set_slope) {
            double value = number(words[2]);
            int order = 1;
            MUST(set_slope(instance, &reference, 1, &order, &value));
        } else if (!strcmp(call, "outputs")) {
            for (outputs_count = 0; outputs_count < n - 1; outputs_count++)
                references[outputs_count] = (uint32_t)strtoul(words[outputs_count + 1], NULL, 10);
        } else if (!strcmp(call, "start") && n == 2) {
            MUST(setup(instance, 0, 0.0, number(words[1]), 0, 0.0));
            MUST(enter(instance));
            MUST(leave(instance));
        } else if (!strcmp(call, "step") && n == 3) {
            MUST(do_step(instance, number(words[1]), number(words[2]), 1));
            MUST(get_real(instance, references, outputs_count, outputs));
            hash = hashed(hash, outputs, outputs_count * sizeof *outputs);
        } else if (!strcmp(call, "print") && n == 2) {
            printf("%s", words[1]);
            for (size_t i = 0; i < outputs_count; i++)
                printf(" %016llx", bits(outputs[i]));
            printf(" hash %016llx\n", (unsigned long long)hash);
        } else if (!strcmp(call, "save") && n == 2) {
            void *state = NULL;
            size_t size = 0;
            char *bytes;
            FILE *file = fopen(words[1], "wb");
            MUST(get_state(instance, &state));
            MUST(state_size(instance, state, &size));
            bytes = malloc(size);
            if (!file || !bytes)
                fail("cannot write");
            MUST(serialize(instance, state, bytes, size));
            MUST(free_state(instance, &state));
            if (fwrite(bytes, 1, size, file) != size || fclose(file))
                fail("cannot write");
            printf("state of %u bytes, hash %016llx\n", (unsigned)size,
                   (unsigned long long)hashed(FRESH, bytes, size));
            free(bytes);
        } else if (!strcmp(call, "load") && n == 2) {
            static char bytes[1 << 20];
            void *state = NULL;
            FILE *file = fopen(words[1], "rb");
            if (!file)
                fail("cannot read");
            size_t size = fread(bytes, 1, sizeof bytes, file);
            fclose(file);
            MUST(deserialize(instance, bytes, size, &state));
            MUST(set_state(instance, state));
            MUST(free_state(instance, &state));
        } else {
            fail("not understood");
        }
    }
    at = "end";
    MUST(terminate(instance));
    free_instance(instance);
    return 0;
}
