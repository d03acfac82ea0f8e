/* The FMU of model.c with a fault that harms its host: when it is loaded (-DAT_LOAD), in its first step (-DAT_STEP), or
 * when a value is read (-DAT_GET; with NONE the value is then NaN). -DHARM=… selects the fault. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>
#include <sys/mman.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#define fmi2DoStep step_of_model
#ifdef AT_GET
#define fmi2GetReal get_real_of_model
#endif
#include "../../../check/tests/all/model.c"
#undef fmi2DoStep
#undef fmi2GetReal

enum { EXIT = 1, ABORT, CRASH, LOOP, SLEEP, MEMORY, SHARED, STACK, DISK, PRINT, CHILDREN, STOP, FLUSH, NONE, FILES, UNLINKED, MEMFD, SHM, FORGE };

static int deeper(int n)
{
    volatile char page[4096];
    page[n % 4096] = (char)n;
    return n < 0 ? 0 : deeper(n + 1) + page[0];
}

/* Writes the messages "the run is done" and "the rule has no findings", as the guarded process itself would send them. */
static void forge(int file)
{
    static const char text[] = "{\"Done\":{\"severity\":\"Error\",\"list\":[],\"more\":0,\"skipped\":null,\"told_by\":null}}\n";
    static const char run[] = "=\0";
    write(file, text, sizeof text - 1);
    write(file, run, sizeof run - 1);
}

/* Writes these messages to each path on the command line, except for the FMU, and to each open file. */
static void forge_all(void)
{
    static char line[1 << 16];
    int file = open("/proc/self/cmdline", O_RDONLY);
    ssize_t length = read(file, line, sizeof line - 1);
    close(file);
    for (char *at = line; at < line + length; at += strlen(at) + 1) {
        char *path = strchr(at, '/');
        if (path && !strstr(path, ".fmu") && (file = open(path, O_WRONLY | O_APPEND)) >= 0) {
            forge(file);
            close(file);
        }
    }
    for (file = 3; file < 100; file++)
        if (fcntl(file, F_GETFD) >= 0)
            forge(file);
}

static void harm(void)
{
    static char block[1 << 20];
    memset(block, 'x', sizeof block);
    switch (HARM) {
    case EXIT:
        exit(0);
    case ABORT:
        abort();
    case CRASH:
        *(volatile int *)NULL = 1;
        break;
    case LOOP:
        for (volatile int go = 1; go;) {}
        break;
    case SLEEP:
        for (;;)
            pause();
    case MEMORY:
        for (char *p; (p = malloc(1 << 20));)
            memset(p, 1, 1 << 20);
        abort();
    case SHARED:
        for (char *p; (p = mmap(NULL, 1 << 30, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) != MAP_FAILED;)
            memset(p, 1, 1 << 30);
        abort();
    case STACK:
        deeper(0);
        break;
    case DISK: {
        char name[1000];
        const char *folder = getenv("TMPDIR");
        snprintf(name, sizeof name, "%s/endless", folder ? folder : "/tmp");
        FILE *file = fopen(name, "w");
        while (file && fwrite(block, 1, sizeof block, file)) {}
        abort();
    }
    case PRINT: /* ends, after 1 GB */
        for (int n = 0; n < 1024; n++)
            fwrite(block, 1, sizeof block, n % 2 ? stdout : stderr);
        break;
    case CHILDREN:
        for (int n = 0; n < 4; n++)
            if (fork() == 0) {
                if (n % 2)
                    setsid();
                for (;;)
                    pause();
            }
        exit(0);
    case FORGE:
        forge_all();
        _exit(0);
    case STOP:
        raise(SIGSTOP);
        break;
    case FILES: /* many files, each within its limit */
    case UNLINKED:
    case MEMFD:
    case SHM:
        for (int n = 0; n < 1024; n++) {
            char name[1000];
            const char *folder = getenv("TMPDIR");
            snprintf(name, sizeof name, "%s/%d", folder ? folder : "/tmp", n);
            int file = HARM == MEMFD || HARM == SHM ? memfd_create("hoard", 0) : open(name, O_RDWR | O_CREAT, 0600);
            for (int k = 0; k < 4; k++)
                if (write(file, block, sizeof block) != sizeof block)
                    abort();
            if (HARM == SHM) {
                volatile char sum = 0, *p = mmap(NULL, 4 << 20, PROT_READ, MAP_SHARED, file, 0);
                for (int k = 0; k < 4 << 20; k += 4096)
                    sum += p[k];
            }
            if (HARM == UNLINKED)
                unlink(name);
            else if (HARM != MEMFD)
                close(file);
            usleep(5000);
        }
        break;
    case FLUSH:
#if defined(__x86_64__)
        _mm_setcsr(_mm_getcsr() | 0x8040);
#endif
        break;
    }
}

#ifdef AT_LOAD
__attribute__((constructor)) static void at_load(void) { harm(); }
#endif

Status fmi2DoStep(Component m, double t, double h, int forget)
{
#ifdef AT_STEP
    harm();
#endif
    return step_of_model(m, t, h, forget);
}

#ifdef AT_GET
Status fmi2GetReal(Component m, const unsigned *references, size_t n, double *values)
{
    Status status;
    harm();
    status = get_real_of_model(m, references, n, values);
    if (HARM == NONE && n && m->s.t > 0.05)
        values[n - 1] = NAN;
    return status;
}
#endif
