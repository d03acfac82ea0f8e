/* Lets the hostile host of host.c loose on the FMU's binary that this program is linked with: with
 * files (a fuzzer's corpus), or with noise of a seed.
 *
 *   replay GUID SLOWEST FILE…            # SLOWEST: seconds that one call may take
 *   replay GUID SLOWEST --noise COUNT SEED */
#include "host.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint8_t bytes[1 << 16];

/* SplitMix64 (Steele, Lea, Flood 2014) */
static uint64_t next(uint64_t *state) {
    uint64_t z = *state += 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
}

int main(int count, char **arguments) {
    if (count < 4) {
        fprintf(stderr, "usage: replay GUID SLOWEST FILE… | --noise COUNT SEED\n");
        return 2;
    }
    host_slowest_allowed = atof(arguments[2]);
    if (!strcmp(arguments[3], "--noise") && count == 6) {
        uint64_t seed = strtoull(arguments[5], NULL, 10);
        for (long n = atol(arguments[4]); n > 0; n--) {
            size_t size = next(&seed) % 1000;
            for (size_t i = 0; i < size; i++)
                bytes[i] = (uint8_t)next(&seed);
            host_run(arguments[1], bytes, size);
        }
    } else {
        for (int n = 3; n < count; n++) {
            FILE *file = fopen(arguments[n], "rb");
            if (!file) {
                perror(arguments[n]);
                return 1;
            }
            size_t size = fread(bytes, 1, sizeof bytes, file);
            fclose(file);
            host_run(arguments[1], bytes, size);
        }
    }
    printf("%lu inputs, %lu calls, %lu accepted, %lu messages, slowest %.3f s (%s)\n",
           host_report.inputs, host_report.calls, host_report.accepted, host_report.messages,
           host_report.slowest, host_report.slowest_call ? host_report.slowest_call : "none");
    return 0;
}
