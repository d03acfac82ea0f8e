/* Types of FMI 2.0 that the FMUs in C of these tests share. */
#include <stddef.h>

typedef int Status;
typedef const char *String;
enum { OK, WARNING, DISCARD, ERROR };

typedef void (*Logger)(void *, String, Status, String, String, ...);
struct callbacks {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, Status);
    void *environment;
};
struct event_info {
    int needed, terminate, nominals, values, defined;
    double next;
};
