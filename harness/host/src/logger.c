/* FMI 2.0's logger callback is variadic (printf style), which stable Rust cannot define. This shim formats the message
 * and passes on a plain string. The FMU may pass any pointer as environment; nobody dereferences it. */
#include <stdarg.h>
#include <stdio.h>

typedef void (*log_message)(void *environment, int status, const char *category,
                            const char *text);

static log_message hubslosh_log_message;

void hubslosh_set_log_message(log_message function) { hubslosh_log_message = function; }

void hubslosh_logger(void *environment, const char *instance, int status,
                     const char *category, const char *format, ...)
{
    char text[4096];
    va_list arguments;

    (void)instance;
    if (!format)
        return;
    va_start(arguments, format);
    if (vsnprintf(text, sizeof text, format, arguments) < 0)
        text[0] = 0;
    va_end(arguments);
    hubslosh_log_message(environment, status, category, text);
}
