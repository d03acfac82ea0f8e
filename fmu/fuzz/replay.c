/* Runs the hostile host of host.c against the FMU with which this program is linked. The inputs are files (the corpus of a
 * fuzzer), or random bytes from a seed.
 *
 *   replay FMU… SLOWEST FILE…            # SLOWEST: largest CPU time of a call, s
 *   replay FMU… SLOWEST --noise COUNT SEED
 *
 * FMU…: the fields of `struct host_fmu` in their order: GUID, token and five numbers. */
#include "host.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint8_t bytes[1 << 16];

/* Returns the next number of the SplitMix64 generator (Steele, Lea, Flood 2014). */
static uint64_t next(uint64_t *state) {
    uint64_t z = *state += 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
}

int main(int count, char **arguments) {
    if (count < 10) {
        fprintf(stderr, "usage: replay GUID TOKEN VARIABLES OUTPUTS STATES INDICATORS INPUTS SLOWEST "
                        "FILE… | --noise COUNT SEED\n");
        return 2;
    }
    size_t sizes[5];
    for (int n = 0; n < 5; n++)
        sizes[n] = (size_t)atol(arguments[3 + n]);
    struct host_fmu fmu = {arguments[1], arguments[2], sizes[0], sizes[1], sizes[2], sizes[3], sizes[4]};
    host_slowest_allowed = atof(arguments[8]);
    if (!strcmp(arguments[9], "--noise") && count == 12) {
        uint64_t seed = strtoull(arguments[11], NULL, 10);
        for (long n = atol(arguments[10]); n > 0; n--) {
            size_t size = next(&seed) % 1000;
            for (size_t i = 0; i < size; i++)
                bytes[i] = (uint8_t)next(&seed);
            host_run(&fmu, bytes, size);
        }
    } else {
        for (int n = 9; n < count; n++) {
            FILE *file = fopen(arguments[n], "rb");
            if (!file) {
                perror(arguments[n]);
                return 1;
            }
            size_t size = fread(bytes, 1, sizeof bytes, file);
            fclose(file);
            host_run(&fmu, bytes, size);
        }
    }
    printf("%lu inputs, %lu calls, %lu accepted, %lu errors, %lu messages, slowest %.3f s (%s)\n",
           host_report.inputs, host_report.calls, host_report.accepted, host_report.errors, host_report.messages,
           host_report.slowest, host_report.slowest_call ? host_report.slowest_call : "none");
    return 0;
}
