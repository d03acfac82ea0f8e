/* A small host: plays a list of FMI 2.0 calls to one FMU binary and prints the
 * bits of what it answers. Numbers travel as the hexadecimal digits of their
 * bits, so that neither this program nor the C library of a platform computes
 * or converts any. harness/platforms/compare writes the list and runs the same
 * one on every platform.
 *
 *   replay LIBRARY GUID < calls
 *
 * Calls, one a line (T, H, X: 16 hexadecimal digits of a double):
 *   real REFERENCE X | integer REFERENCE NUMBER   set a variable
 *   slope REFERENCE X                             first derivative of an input
 *   outputs COUNT REFERENCE...                    what is read after each step
 *   start T                                       set up and initialise
 *   step T H                                      one step
 *   print NAME                                    bits of outputs and hash so far
 *   save FILE | load FILE                         serialised state
 */
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

#define FUNCTION(type, variable, name, ...)                                                        \
    type (*variable)(__VA_ARGS__);                                                                 \
    *(void **)&variable = named(library, name);                                                    \
    if (!variable)                                                                                 \
    fail("the binary lacks " name)
#define MUST(call)                                                                                 \
    if ((call) != OK)                                                                              \
    fail("not fmi2OK: " #call)

int main(int count, char **arguments)
{
    static char line[4096], copy[4096];
    struct callbacks callbacks = {logger, calloc, free, NULL, NULL};
    uint32_t references[OUTPUTS];
    double outputs[OUTPUTS];
    size_t outputs_count = 0;
    uint64_t hash = FRESH;
    void *library;
    Component instance;

    if (count != 3)
        fail("usage: replay LIBRARY GUID < calls");
    library = opened(arguments[1]);
    if (!library)
        fail("the binary cannot be loaded");
    FUNCTION(Component, instantiate, "fmi2Instantiate", const char *, int, const char *,
             const char *, const struct callbacks *, int, int);
    FUNCTION(void, free_instance, "fmi2FreeInstance", Component);
    FUNCTION(int, setup, "fmi2SetupExperiment", Component, int, double, double, int, double);
    FUNCTION(int, enter, "fmi2EnterInitializationMode", Component);
    FUNCTION(int, leave, "fmi2ExitInitializationMode", Component);
    FUNCTION(int, terminate, "fmi2Terminate", Component);
    FUNCTION(int, get_real, "fmi2GetReal", Component, const uint32_t *, size_t, double *);
    FUNCTION(int, set_real, "fmi2SetReal", Component, const uint32_t *, size_t, const double *);
    FUNCTION(int, set_integer, "fmi2SetInteger", Component, const uint32_t *, size_t, const int *);
    FUNCTION(int, set_slope, "fmi2SetRealInputDerivatives", Component, const uint32_t *, size_t,
             const int *, const double *);
    FUNCTION(int, do_step, "fmi2DoStep", Component, double, double, int);
    FUNCTION(int, get_state, "fmi2GetFMUstate", Component, void **);
    FUNCTION(int, set_state, "fmi2SetFMUstate", Component, void *);
    FUNCTION(int, free_state, "fmi2FreeFMUstate", Component, void **);
    FUNCTION(int, state_size, "fmi2SerializedFMUstateSize", Component, void *, size_t *);
    FUNCTION(int, serialize, "fmi2SerializeFMUstate", Component, void *, char *, size_t);
    FUNCTION(int, deserialize, "fmi2DeSerializeFMUstate", Component, const char *, size_t, void **);

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
        } else if (!strcmp(call, "slope") && n == 3) {
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
