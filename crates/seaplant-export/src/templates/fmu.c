/* A co-simulation FMU of FMI 3.0 around seaplant_plant.h; source, units and uncertainty stand there.
   Types and functions are those that the standard defines. */
#include <stdlib.h>
#include <string.h>

#include "seaplant_plant.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi3Instance;
typedef unsigned int fmi3ValueReference;
typedef double fmi3Float64;
typedef _Bool fmi3Boolean;
typedef const char *fmi3String;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*LogMessage)(void *, fmi3Status, fmi3String, fmi3String);

#define TOKEN "@TOKEN@"
#define COUNT @COUNT@
#define CURRENT @CURRENT@
#define START @START@
#define THETA @THETA@
#define OUTPUT @OUTPUT@
#define LONGEST_STEP 0.02

static const double start[COUNT] = {
@STARTS@};

/* t time, i input, p tunable parameter, f fixed parameter, o output. */
static const char kind[] = "@KINDS@";

typedef struct {
    double value[COUNT];
    double x[13];
@ACTUATORS@    int is_running;
    LogMessage log;
    void *environment;
} Fmu;

static fmi3Status fail(const Fmu *fmu, const char *message)
{
    if (fmu->log)
        fmu->log(fmu->environment, fmi3Error, "logStatusError", message);
    return fmi3Error;
}

static void begin(Fmu *fmu)
{
    static const double e3[3] = {0.0, 0.0, 1.0};
    double down[3];
    const double *from = &fmu->value[START];
    memcpy(fmu->x, from, 3 * sizeof(double));
    seaplant_quaternion(from[3], from[4], from[5], &fmu->x[3]);
    memcpy(&fmu->x[7], from + 6, 6 * sizeof(double));
    seaplant_to_body(&fmu->x[3], e3, down);
    seaplant_hold(down, &fmu->x[7]);
@BEGIN_ACTUATORS@}

static void reset(Fmu *fmu)
{
    memcpy(fmu->value, start, sizeof start);
    fmu->is_running = 0;
    begin(fmu);
}

/* tau for the next h seconds. */
static void wrench_of(Fmu *fmu, double h, double tau[6])
{
    int k;
    (void)h;
    for (k = 0; k < 6; ++k)
        tau[k] = 0.0;
@TAU@@THRUSTERS@}

static void publish(Fmu *fmu)
{
    double *to = &fmu->value[OUTPUT];
    if (!fmu->is_running)
        begin(fmu);
    memcpy(to, fmu->x, 3 * sizeof(double));
    seaplant_angles(&fmu->x[3], to + 3);
    memcpy(to + 6, &fmu->x[7], 6 * sizeof(double));
}

EXPORT const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[],
    size_t count, void *environment, LogMessage log, void *intermediate)
{
    Fmu *fmu;
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early;
    (void)required, (void)count, (void)intermediate;
    if (!token || strcmp(token, TOKEN) != 0) {
        if (log)
            log(environment, fmi3Error, "logStatusError", "the instantiation token is another model's");
        return NULL;
    }
    fmu = calloc(1, sizeof *fmu);
    if (fmu) {
        fmu->log = log;
        fmu->environment = environment;
        reset(fmu);
    }
    return fmu;
}

EXPORT void fmi3FreeInstance(fmi3Instance instance)
{
    free(instance);
}

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count,
                                      const fmi3String categories[])
{
    (void)instance, (void)on, (void)count, (void)categories;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance,
                                              fmi3Float64 tolerance, fmi3Float64 from,
                                              fmi3Boolean has_stop, fmi3Float64 stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Fmu *)instance)->value[0] = from;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    Fmu *fmu = instance;
    begin(fmu);
    fmu->is_running = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    (void)instance;
    return fmi3OK;
}

EXPORT fmi3Status fmi3Terminate(fmi3Instance instance)
{
    (void)instance;
    return fmi3OK;
}

EXPORT fmi3Status fmi3Reset(fmi3Instance instance)
{
    reset(instance);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[],
                                 size_t count, fmi3Float64 values[], size_t value_count)
{
    Fmu *fmu = instance;
    size_t k;
    if (count != value_count)
        return fail(fmu, "there is not one value for each reference");
    publish(fmu);
    for (k = 0; k < count; ++k) {
        if (references[k] >= COUNT)
            return fail(fmu, "there is no variable of that reference");
        values[k] = fmu->value[references[k]];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[],
                                 size_t count, const fmi3Float64 values[], size_t value_count)
{
    Fmu *fmu = instance;
    size_t k;
    if (count != value_count)
        return fail(fmu, "there is not one value for each reference");
    for (k = 0; k < count; ++k) {
        fmi3ValueReference at = references[k];
        if (at >= COUNT)
            return fail(fmu, "there is no variable of that reference");
        if (kind[at] == 't' || kind[at] == 'o')
            return fail(fmu, "time and outputs cannot be set");
        if (kind[at] == 'f' && fmu->is_running)
            return fail(fmu, "the state at the beginning is set before the simulation runs");
        if (!isfinite(values[k]))
            return fail(fmu, "a value is not finite");
        fmu->value[at] = values[k];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 from, fmi3Float64 length,
                             fmi3Boolean no_set, fmi3Boolean *events, fmi3Boolean *terminate,
                             fmi3Boolean *early, fmi3Float64 *last)
{
    Fmu *fmu = instance;
    double tau[6];
    long steps = (long)ceil(length / LONGEST_STEP - 1e-9), k;
    (void)no_set;
    *events = *terminate = *early = 0;
    *last = from;
    if (!(length > 0.0) || length > 1e6)
        return fail(fmu, "a step must be above zero and at most 1e6 s");
    if (steps < 1)
        steps = 1;
    for (k = 0; k < steps; ++k) {
        wrench_of(fmu, length / steps, tau);
        if (seaplant_step_of(&fmu->value[THETA], fmu->x, tau, &fmu->value[CURRENT], length / steps))
            return fail(fmu, "the mass matrix is not positive definite");
        if (!(fabs(fmu->x[7]) + fabs(fmu->x[8]) + fabs(fmu->x[9]) + fabs(fmu->x[10])
                  + fabs(fmu->x[11]) + fabs(fmu->x[12]) < 1e4))
            return fail(fmu, "the velocity runs away");
    }
    fmu->value[0] = *last = from + length;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance instance, void **state)
{
    if (!*state)
        *state = malloc(sizeof(Fmu));
    if (!*state)
        return fail(instance, "there is no memory for a state");
    memcpy(*state, instance, sizeof(Fmu));
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance instance, void *state)
{
    memcpy(instance, state, sizeof(Fmu));
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance instance, void **state)
{
    (void)instance;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(void)
{
    return NULL;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(void)
{
    return NULL;
}

/* What modelDescription.xml does not offer: importers look the names up, and call none. */
#define NONE(name) \
    EXPORT fmi3Status fmi3##name(fmi3Instance instance) \
    { \
        return fail(instance, "fmi3" #name " is not offered"); \
    }

NONE(EnterEventMode)
NONE(GetFloat32)
NONE(GetInt8)
NONE(GetUInt8)
NONE(GetInt16)
NONE(GetUInt16)
NONE(GetInt32)
NONE(GetUInt32)
NONE(GetInt64)
NONE(GetUInt64)
NONE(GetBoolean)
NONE(GetString)
NONE(GetBinary)
NONE(GetClock)
NONE(SetFloat32)
NONE(SetInt8)
NONE(SetUInt8)
NONE(SetInt16)
NONE(SetUInt16)
NONE(SetInt32)
NONE(SetUInt32)
NONE(SetInt64)
NONE(SetUInt64)
NONE(SetBoolean)
NONE(SetString)
NONE(SetBinary)
NONE(SetClock)
NONE(GetNumberOfVariableDependencies)
NONE(GetVariableDependencies)
NONE(SerializedFMUStateSize)
NONE(SerializeFMUState)
NONE(DeserializeFMUState)
NONE(GetDirectionalDerivative)
NONE(GetAdjointDerivative)
NONE(EnterConfigurationMode)
NONE(ExitConfigurationMode)
NONE(GetIntervalDecimal)
NONE(GetIntervalFraction)
NONE(GetShiftDecimal)
NONE(GetShiftFraction)
NONE(SetIntervalDecimal)
NONE(SetIntervalFraction)
NONE(SetShiftDecimal)
NONE(SetShiftFraction)
NONE(EvaluateDiscreteStates)
NONE(UpdateDiscreteStates)
NONE(EnterContinuousTimeMode)
NONE(CompletedIntegratorStep)
NONE(SetTime)
NONE(SetContinuousStates)
NONE(GetContinuousStateDerivatives)
NONE(GetEventIndicators)
NONE(GetContinuousStates)
NONE(GetNominalsOfContinuousStates)
NONE(GetNumberOfEventIndicators)
NONE(GetNumberOfContinuousStates)
NONE(GetOutputDerivatives)
NONE(ActivateModelPartition)
