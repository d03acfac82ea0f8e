/* A C host that passes wrong handles to functions of an FMU. Every such call must return an error, and the instance
 * behind the handle must keep working. The handles belong to the library of another FMU, to a second copy of the same
 * library, to a freed instance or to a freed state; others are NULL, or numbers that cannot be addresses. The program is
 * compiled for FMI 2.0 and for FMI 3.0; handles of one version are also passed to the functions of the other version.
 *
 *   handles LIBRARY IDENTITY OUTPUT OTHER_LIBRARY...
 *
 * OUTPUT is the value reference of a Real. */
#define _GNU_SOURCE
#include "fmi.h"

/* Functions whose only important argument is the handle. Their names exist in both versions of FMI. */
static const char *const of_handle[] = {
    "EnterInitializationMode", "ExitInitializationMode", "Terminate", "Reset", "EnterContinuousTimeMode", "EnterEventMode",
};

/* Calls all functions of both versions that need only a handle, and frees the handle as if it were an instance. */
static void refuse(void *from, void *handle, int own, const char *what)
{
    for (int version = 2; version <= 3; version++) {
        char name[80];
        for (size_t i = 0; i < sizeof of_handle / sizeof *of_handle; i++) {
            int (*call)(void *);
            if (version == FMI && own)
                continue;
            snprintf(name, sizeof name, "fmi%d%s", version, of_handle[i]);
            if (strcmp(name, "fmi3EnterInitializationMode") == 0)
                continue; /* it takes more */
            *(void **)&call = dlsym(from, name);
            if (call && call(handle) != ERROR) {
                fprintf(stderr, "%s of %s is not an error\n", name, what);
                exit(1);
            }
        }
        snprintf(name, sizeof name, "fmi%dFreeInstance", version);
        void (*release)(void *);
        *(void **)&release = dlsym(from, name);
        if (release && !(version == FMI && own))
            release(handle);
    }
}

int main(int argc, char **argv)
{
    Instance c;
    State state = NULL, kept;
    Reference output;
    double x;
    if (argc < 4)
        return 2;
    identity = argv[2];
    output = (Reference)strtoul(argv[3], NULL, 10);
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library)
        fail(dlerror());
    c = instantiate(CO_SIMULATION);
    if (!c)
        fail("no instance");
    MUST(initialise(c, CO_SIMULATION, 0, 0));
    MUST(save(c, &state));
    refuse(library, c, 1, "an instance of the other version of FMI");
    for (int n = 4; n < argc; n++) {
        void *other = dlopen(argv[n], RTLD_NOW | RTLD_LOCAL);
        if (!other)
            fail(dlerror());
        refuse(other, c, 0, "an instance of another library");
        refuse(other, state, 0, "a state of another library");
    }
    /* A state must not be accepted as an instance, and an instance not as a state. */
    refuse(library, state, 0, "a state");
    if (restore(c, c) != ERROR)
        fail("an instance was taken as a state");
#if FMI == 2 /* an error has ended the simulation in 3.0 */
    MUST(do_step(c, 0, 0.1));
#endif
    MUST(get_reals(c, &output, 1, &x));
    refuse(library, NULL, 0, "NULL");
    refuse(library, (void *)1, 0, "the number 1");
    refuse(library, (void *)8, 0, "the number 8");
    refuse(library, (void *)((char *)c + 4), 0, "an address within an instance");
    kept = state;
    MUST(free_state(c, &state));
    if (restore(c, kept) != ERROR)
        fail("a freed state was taken");
    free_instance(c);
    refuse(library, c, 0, "a freed instance");
    printf("every handle that is not the function's own is an error\n");
    return 0;
}
