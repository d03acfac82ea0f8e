/* Calls each function of FMI 3.0 in each mode of an instance. A call must be either allowed, or refused with
 * fmi3Error and a message.
 *
 *   modes LIBRARY TOKEN OUTPUT DERIVED INPUT INTEGER ENUMERATION BOOLEAN SETS
 *
 * The arguments are value references: a continuous output that takes part in intermediate update; a variable that
 * depends directly on the continuous input; this input, which also takes part; parameters of the three types, or, if
 * SETS is 0, a Boolean that can only be read. The compiler's command line defines INDICATORS and STATES.
 *
 * Letters of the modes: I Instantiated, K Configuration, M Initialization, V Event, C Continuous-Time, S Step, G Intermediate
 * Update for getting, P for setting, T Terminated. Each case uses a new instance, because an error terminates it. */
#define _GNU_SOURCE
#include "fmi.h"

static Reference output, derived, input, integer, enumeration, boolean;
static int sets_boolean;
static char last_message[4000];

static void keep(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment;
    if (!category)
        fail("a message without a category");
    if (status >= fmi3Discard)
        snprintf(last_message, sizeof last_message, "%s", message);
}

/* ---- What is called ---- */

/* another instance of this kind, a snapshot of it directly after it was made, and the bytes of the snapshot */
static Instance other;
static State snapshot;
static fmi3Byte bytes[1 << 20];
static size_t size;

typedef Status Calls(Instance c);

/* FUNCTION(name, modes in Model Exchange, modes in Co-Simulation, modes beyond the standard, expression)
 *
 * The modes are those of FMI 3.0.2: 2.3 (states common to the interfaces), 3.2.1, 4.2.1. Co-Simulation uses event mode.
 * Reasons for modes beyond the standard:
 * - the standard does not say when a host may ask for dependencies; 2.2.9 allows it from the start;
 * - fmusim 0.8 asks for the numbers of states and indicators in any mode;
 * - some hosts always enter and leave configuration mode, even if there is nothing to configure;
 * - a host may also reset the instance and set its logging in configuration mode;
 * - a snapshot is not part of the instance, and may be freed at any time;
 * - nominal values do not change, and may be asked for from the start;
 * - fmi3EvaluateDiscreteStates does nothing, and is also allowed in initialization mode. */
#define FUNCTIONS \
    FUNCTION(fmi3SetDebugLogging, "IMVCT", "IMVST", "K", (c, 1, 0, NULL)) \
    FUNCTION(fmi3EnterInitializationMode, "I", "I", "", (c, 0, 0, 0, 0, 0)) \
    FUNCTION(fmi3ExitInitializationMode, "M", "M", "", (c)) \
    FUNCTION(fmi3EnterEventMode, "C", "S", "", (c)) \
    FUNCTION(fmi3Terminate, "VC", "VS", "", (c)) \
    FUNCTION(fmi3Reset, "IMVCT", "IMVST", "K", (c)) \
    FUNCTION(fmi3GetFloat32, "", "", "", (c, &output, 1, any, 1)) \
    FUNCTION(fmi3GetFloat64, "IMVCT", "IMVSGT", "", (c, readable, 1, any, 1)) \
    FUNCTION(fmi3GetInt8, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetUInt8, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetInt16, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetUInt16, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetInt32, "IMVCT", "IMVST", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetUInt32, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetInt64, "IMVCT", "IMVST", "", (c, &enumeration, 1, any, 1)) \
    FUNCTION(fmi3GetUInt64, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetBoolean, "IMVCT", "IMVST", "", (c, &boolean, 1, any, 1)) \
    FUNCTION(fmi3GetString, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3GetBinary, "", "", "", (c, &integer, 1, &count, any, 1)) \
    FUNCTION(fmi3GetClock, "", "", "", (c, &integer, 1, any)) \
    FUNCTION(fmi3SetFloat32, "", "", "", (c, &input, 1, any, 1)) \
    FUNCTION(fmi3SetFloat64, "IMVC", "IMVSP", "", (c, &input, 1, any, 1)) \
    FUNCTION(fmi3SetInt8, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3SetUInt8, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3SetInt16, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3SetUInt16, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3SetInt32, "IM", "IM", "", (c, &integer, 1, one, 1)) \
    FUNCTION(fmi3SetUInt32, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3SetInt64, "IM", "IM", "", (c, &enumeration, 1, &item, 1)) \
    FUNCTION(fmi3SetUInt64, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3SetBoolean, "IM", "IM", "", (c, &boolean, 1, any, 1)) \
    FUNCTION(fmi3SetString, "", "", "", (c, &integer, 1, any, 1)) \
    FUNCTION(fmi3SetBinary, "", "", "", (c, &integer, 1, &count, any, 1)) \
    FUNCTION(fmi3SetClock, "", "", "", (c, &integer, 1, any)) \
    FUNCTION(fmi3GetNumberOfVariableDependencies, "", "", "IMVCST", (c, output, &count)) \
    FUNCTION(fmi3GetVariableDependencies, "", "", "IMVCST", (c, output, places, references, others, kinds, dependencies(c))) \
    FUNCTION(fmi3GetFMUState, "IMVCT", "IMVST", "", (c, &made)) \
    FUNCTION(fmi3SetFMUState, "IMVCT", "IMVST", "", (c, snapshot)) \
    FUNCTION(fmi3FreeFMUState, "IMVCT", "IMVST", "KGP", (c, &spare)) \
    FUNCTION(fmi3SerializedFMUStateSize, "IMVCT", "IMVST", "", (c, snapshot, &count)) \
    FUNCTION(fmi3SerializeFMUState, "IMVCT", "IMVST", "", (c, snapshot, bytes, size)) \
    FUNCTION(fmi3DeserializeFMUState, "IMVCT", "IMVST", "", (c, bytes, size, &made)) \
    FUNCTION(fmi3GetDirectionalDerivative, "MVCT", "MVST", "", (c, &derived, 1, &input, 1, &seed, 1, any, 1)) \
    FUNCTION(fmi3GetAdjointDerivative, "MVCT", "MVST", "", (c, &derived, 1, &input, 1, &seed, 1, any, 1)) \
    FUNCTION(fmi3EnterConfigurationMode, "", "", "I", (c)) \
    FUNCTION(fmi3ExitConfigurationMode, "K", "K", "", (c)) \
    FUNCTION(fmi3GetIntervalDecimal, "", "", "", (c, &integer, 1, any, any)) \
    FUNCTION(fmi3GetIntervalFraction, "", "", "", (c, &integer, 1, any, any, any)) \
    FUNCTION(fmi3GetShiftDecimal, "", "", "", (c, &integer, 1, any)) \
    FUNCTION(fmi3GetShiftFraction, "", "", "", (c, &integer, 1, any, any)) \
    FUNCTION(fmi3SetIntervalDecimal, "", "", "", (c, &integer, 1, any)) \
    FUNCTION(fmi3SetIntervalFraction, "", "", "", (c, &integer, 1, any, any)) \
    FUNCTION(fmi3SetShiftDecimal, "", "", "", (c, &integer, 1, any)) \
    FUNCTION(fmi3SetShiftFraction, "", "", "", (c, &integer, 1, any, any)) \
    FUNCTION(fmi3EvaluateDiscreteStates, "V", "V", "M", (c)) \
    FUNCTION(fmi3UpdateDiscreteStates, "V", "V", "", (c, flags, flags + 1, flags + 2, flags + 3, flags + 4, any)) \
    FUNCTION(fmi3EnterContinuousTimeMode, "V", "", "", (c)) \
    FUNCTION(fmi3CompletedIntegratorStep, "C", "", "", (c, 1, flags, flags + 1)) \
    FUNCTION(fmi3SetTime, "C", "", "", (c, 0)) \
    FUNCTION(fmi3SetContinuousStates, "C", "", "", (c, states(c), STATES)) \
    FUNCTION(fmi3GetContinuousStateDerivatives, "MVCT", "", "", (c, numbers, STATES)) \
    FUNCTION(fmi3GetEventIndicators, "MVCT", "", "", (c, numbers, INDICATORS)) \
    FUNCTION(fmi3GetContinuousStates, "MVCT", "", "", (c, numbers, STATES)) \
    FUNCTION(fmi3GetNominalsOfContinuousStates, "MVCT", "", "I", (c, numbers, STATES)) \
    FUNCTION(fmi3GetNumberOfEventIndicators, "IV", "", "KMCT", (c, &count)) \
    FUNCTION(fmi3GetNumberOfContinuousStates, "IV", "", "KMCT", (c, &count)) \
    FUNCTION(fmi3EnterStepMode, "", "V", "", (c)) \
    FUNCTION(fmi3GetOutputDerivatives, "", "SGT", "", (c, &output, 1, &order, any, 1)) \
    FUNCTION(fmi3DoStep, "", "S", "", (c, 0, 0.01, 1, flags, flags + 1, flags + 2, any)) \
    FUNCTION(fmi3ActivateModelPartition, "", "", "", (c, integer, 0))

/* arrays for results, and arguments */
static union { double x; fmi3Int64 n; void *p; fmi3Byte b[64]; } room[8];
static void *any = room;
static double numbers[STATES + INDICATORS + 1];
static fmi3Boolean flags[5];
static size_t count, places[1000], others[1000];
static Reference references[1000];
static fmi3DependencyKind kinds[1000];
static const double seed = 1;
static const fmi3Int32 one[] = {1}, order = 1;
static const fmi3Int64 item = 1;
static State made, spare;
/* A variable that can be read in this mode: before initialization mode only variables with start values can be read. */
static const Reference *readable;

/* Asks for all dependencies, or for any number of them in a mode in which the call must be refused. */
static size_t dependencies(Instance c)
{
    size_t n = 0;
    char before[sizeof last_message];
    memcpy(before, last_message, sizeof before);
    if (CALL(fmi3GetNumberOfVariableDependencies)(c, output, &n) != fmi3OK)
        n = 0;
    memcpy(last_message, before, sizeof before);
    return n;
}

/* Returns the present states if they can be read. */
static const double *states(Instance c)
{
    CALL(fmi3GetContinuousStates)(c, numbers, STATES);
    return numbers;
}

#define FUNCTION(name, me, cs, beyond, arguments) \
    static Status call_##name(Instance c) { (void)c; return (Status)CALL(name) arguments; }
FUNCTIONS
#undef FUNCTION

static const struct { const char *name, *allowed[KINDS], *beyond; Calls *call; } table[] = {
#define FUNCTION(name, me, cs, beyond, arguments) {#name, {me, cs}, beyond, call_##name},
    FUNCTIONS
#undef FUNCTION
};
enum { ROWS = sizeof table / sizeof *table };

/* ---- Modes ---- */

/* The function that is called once within a step, and the result of this call. */
static struct { Instance c; Calls *call; char mode; int called; Status status; char said[sizeof last_message]; } within;

static void update(fmi3InstanceEnvironment environment, fmi3Float64 t, fmi3Boolean set_requested,
                   fmi3Boolean get_allowed, fmi3Boolean step_finished, fmi3Boolean can_return_early,
                   fmi3Boolean *early_return_requested, fmi3Float64 *early_return_time)
{
    (void)environment, (void)step_finished, (void)can_return_early;
    *early_return_requested = 0, *early_return_time = t;
    if (within.call && !within.called && (within.mode == 'P' ? set_requested : get_allowed)) {
        within.called = 1;
        within.status = within.call(within.c);
        memcpy(within.said, last_message, sizeof within.said);
    }
}

static Instance make(int kind)
{
    const Reference required[] = {input, output};
    Instance c = kind == MODEL_EXCHANGE
        ? CALL(fmi3InstantiateModelExchange)("host", identity, NULL, 0, 1, NULL, keep)
        : CALL(fmi3InstantiateCoSimulation)("host", identity, NULL, 0, 1, 1, 1, required, 2, NULL, keep, update);
    if (!c)
        fail("no instance");
    return c;
}

static Status step(Instance c)
{
    fmi3Boolean event, end, early;
    double last;
    return (Status)CALL(fmi3DoStep)(c, 0, 0.01, 1, &event, &end, &early, &last);
}

/* Returns a new instance in a mode. */
static Instance in(int kind, char mode)
{
    Instance c = make(kind);
    int again;
    if (mode == 'I')
        return c;
    if (mode == 'K') {
        MUST((Status)CALL(fmi3EnterConfigurationMode)(c));
        return c;
    }
    MUST((Status)CALL(fmi3EnterInitializationMode)(c, 0, 0, 0, 0, 0));
    if (mode == 'M')
        return c;
    MUST((Status)CALL(fmi3ExitInitializationMode)(c));
    if (mode == 'V')
        return c;
    do
        MUST(update_discrete_states(c, &again));
    while (again);
    MUST((Status)(kind == MODEL_EXCHANGE ? CALL(fmi3EnterContinuousTimeMode)(c) : CALL(fmi3EnterStepMode)(c)));
    if (mode == 'T')
        MUST((Status)CALL(fmi3Terminate)(c));
    return c;
}

static int wrong;

static void check(int kind, char mode, int row)
{
    const char *name = table[row].name;
    int allowed = strchr(table[row].allowed[kind], mode) != NULL;
    /* A Boolean that can only be read has no start value. */
    if (!sets_boolean)
        allowed &= table[row].call != call_fmi3SetBoolean && !(table[row].call == call_fmi3GetBoolean && mode == 'I');
    const char *belongs = table[row].allowed[!kind];
    /* Modes beyond the standard are allowed only in the interface to which the function belongs. */
    int lenient = strchr(table[row].beyond, mode) != NULL && (*table[row].allowed[kind] || !*belongs);
    Instance c = in(kind, mode == 'G' || mode == 'P' ? 'S' : mode);
    Status status, expected = allowed || lenient ? OK : ERROR;
    double x;

    *last_message = 0;
    made = spare = NULL;
    MUST((Status)CALL(fmi3GetFMUState)(other, &spare));
    readable = mode == 'I' ? &input : &output;
    memset(room, 0, sizeof room);
    if (mode == 'G' || mode == 'P') {
        within.c = c, within.call = table[row].call, within.mode = mode, within.called = 0;
        step(c);
        within.call = NULL;
        if (!within.called)
            fail("no intermediate update in a step");
        status = within.status;
        memcpy(last_message, within.said, sizeof last_message);
    } else {
        status = table[row].call(c);
    }
    if (status != expected) {
        fprintf(stderr, "%s in mode %c of %s: %d, expected %d: %s\n", name, mode,
                kind == MODEL_EXCHANGE ? "Model Exchange" : "Co-Simulation", status, expected, last_message);
        wrong = 1;
    } else if (status != OK && !strstr(last_message, name)) {
        fprintf(stderr, "%s in mode %c: refused without its name: \"%s\"\n", name, mode, last_message);
        wrong = 1;
    }
    /* After an error values can be read, and the instance can be reset. */
    if (status != OK && CALL(fmi3GetFloat64)(c, &output, 1, &x, 1) != fmi3OK) {
        fprintf(stderr, "%s in mode %c: after the error nothing can be read: %s\n", name, mode, last_message);
        wrong = 1;
    }
    if (spare)
        MUST((Status)CALL(fmi3FreeFMUState)(other, &spare));
    if (made)
        MUST((Status)CALL(fmi3FreeFMUState)(c, &made));
    MUST((Status)CALL(fmi3Reset)(c));
    MUST((Status)CALL(fmi3EnterInitializationMode)(c, 0, 0, 0, 0, 0));
    CALL(fmi3FreeInstance)(c);
}

int main(int argc, char **argv)
{
    const char *modes[KINDS] = {"IKMVCT", "IKMVSGPT"};
    Reference *all[] = {&output, &derived, &input, &integer, &enumeration, &boolean};
    if (argc != 10) {
        fprintf(stderr, "usage: see the beginning of modes.c\n");
        return 2;
    }
    identity = argv[2];
    for (int i = 0; i < 6; i++)
        *all[i] = (Reference)strtoul(argv[3 + i], NULL, 10);
    sets_boolean = atoi(argv[9]);
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library)
        fail(dlerror());
    if (ROWS != 75 - 5)
        fail("of 75 functions all are in the table but fmi3GetVersion, those that instantiate, and fmi3FreeInstance");
    for (int kind = 0; kind < KINDS; kind++) {
        other = make(kind);
        MUST((Status)CALL(fmi3GetFMUState)(other, &snapshot));
        MUST((Status)CALL(fmi3SerializedFMUStateSize)(other, snapshot, &size));
        if (size > sizeof bytes)
            fail("a saved state is larger than expected");
        MUST((Status)CALL(fmi3SerializeFMUState)(other, snapshot, bytes, size));
        for (const char *mode = modes[kind]; *mode; mode++)
            for (int row = 0; row < ROWS; row++)
                check(kind, *mode, row);
        MUST((Status)CALL(fmi3FreeFMUState)(other, &snapshot));
        CALL(fmi3FreeInstance)(other);
    }
    if (strcmp(CALL(fmi3GetVersion)(), "3.0") != 0)
        fail("fmi3GetVersion does not say 3.0");
    if (CALL(fmi3InstantiateScheduledExecution)("host", identity, NULL, 0, 1, NULL, keep, NULL, NULL, NULL)
        || !strstr(last_message, "fmi3InstantiateScheduledExecution"))
        fail("Scheduled Execution is not refused in words");
    CALL(fmi3FreeInstance)(NULL);
    return wrong;
}
