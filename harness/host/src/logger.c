/* FMI 2.0's logger callback is variadic (printf style), which stable Rust
 * cannot define. This shim formats the message and hands on a plain string. */
#include <stdarg.h>
#include <stdio.h>

/* First member of the object behind componentEnvironment (see fmi2.rs). */
struct hubslosh_sink {
    void (*write)(struct hubslosh_sink *sink, int status, const char *category,
                  const char *text);
};

void hubslosh_logger(void *environment, const char *instance, int status,
                     const char *category, const char *format, ...)
{
    char text[4096];
    va_list arguments;
    struct hubslosh_sink *sink = environment;

    (void)instance;
    if (!sink || !format)
        return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    sink->write(sink, status, category ? category : "", text);
}
