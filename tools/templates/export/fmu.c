/*
 * @title@ FMI 2.0 co-simulation.
 *
 * Made by gmhm @version@ from @file@, SHA-256
 * @hash@.
 *
 * One step of the co-simulation is one sample of @file_stem@.c. The inputs hold at the end of the step: what was set before it, moved on by the input
 * derivatives where those were set.
 */
#include "@file_stem@.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* The types of FMI 2.0, fmi2TypesPlatform and fmi2FunctionTypes. */
typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

/* Where sources are linked together, an importer defines the prefix of the functions. */
#define GEAR_JOIN_2(a, b) a##b
#define GEAR_JOIN(a, b) GEAR_JOIN_2(a, b)
#ifdef FMI2_FUNCTION_PREFIX
#define FMI2(name) GEAR_JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) name
#endif
#if defined(_WIN32)
#define FMI2_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI2_EXPORT __attribute__((visibility("default")))
#else
#define FMI2_EXPORT
#endif

#define GUID "@guid@"

/* Inputs, as the recordings name them. */
struct inputs {
@input_fields@};

/* Parameters in SI units, from which the numbers of the gear follow. */
struct settings {
@setting_fields@};

/* What an instance is at a moment: copied whole by fmi2GetFMUstate and written whole by fmi2SerializeFMUstate. */
struct moment {
    struct inputs input;
    struct inputs derivative;
    struct settings setting;
    gear_parameters p;
    gear_state state;
    gear_output output;
    double time;
    int initialised;
};

struct instance {
    struct moment now;
    fmi2CallbackFunctions callbacks;
    char *name;
};

static const struct settings SETTINGS = { @settings@ };

/* The numbers of the gear from its parameters: sections 2 to 4 and 6 of the model. The torque scale stays, which only divides and multiplies. */
static void derive(struct moment *m)
{
    const struct settings *s = &m->setting;
    const double a = s->rated_deflection_rad;
    const double per_scale = a / m->p.scale_nm;
    gear_parameters *p = &m->p;
    double square;
    double discriminant;
    double divisor;
    double rises = INFINITY;

    p->rated = a;
    p->inverse_rated = 1.0 / a;
    p->limit = 1e5 * a;
    p->k1 = s->c1_nm_per_rad * per_scale;
    p->k3 = ((s->c2_nm_per_rad3 * a) * a) * per_scale;
    p->k5 = ((((s->c3_nm_per_rad5 * a) * a) * a) * a) * per_scale;
    /* kappa is 0.9 of the deflection at which f' vanishes, at least 1 and at most 1.5. */
    discriminant = ((2.25 * p->k3) * p->k3) - ((5.0 * p->k5) * p->k1);
    divisor = sqrt((discriminant > 0.0) ? discriminant : 0.0) - (1.5 * p->k3);
    if (p->k1 <= 0.0) {
        rises = 0.0;
    } else if ((discriminant >= 0.0) && (divisor > 0.0)) {
        rises = sqrt(p->k1 / divisor);
    } else {
        /* f' never vanishes. */
    }
    p->knee = (0.9 * rises < 1.0) ? 1.0 : ((0.9 * rises > 1.5) ? 1.5 : (0.9 * rises));
    square = p->knee * p->knee;
    p->knee_torque = p->knee * (p->k1 + (square * (p->k3 + (square * p->k5))));
    p->knee_stiffness = p->k1 + (square * ((3.0 * p->k3) + (square * (5.0 * p->k5))));
    p->knee_stiffness = (p->knee_stiffness > 0.0) ? p->knee_stiffness : 0.0;
@derive@}

static bool is_number(double x)
{
    return isfinite(x) != 0;
}

/* Where an input stands; NULL where the value is none. */
static double *input_at(struct inputs *inputs, fmi2ValueReference reference)
{
    double *at = NULL;
    switch (reference) {
@input_cases@    default:
        break;
    }
    return at;
}

/* Where a parameter stands. Those before @first_term@ are parameters of the base model. */
static double *parameter_at(struct moment *m, fmi2ValueReference reference)
{
    double *at = NULL;
    switch (reference) {
@parameter_cases@    default:
        break;
    }
    return at;
}

static gear_sample sample_of(const struct moment *m, double period)
{
    gear_sample sample;
@sample_values@    (void)period;
    return sample;
}

static void initialise(struct moment *m)
{
    const gear_sample sample = sample_of(m, 0.0);
    m->output = gear_start(&m->p, &m->state, &sample);
}

FMI2_EXPORT const char *FMI2(fmi2GetTypesPlatform)(void)
{
    return "default";
}

FMI2_EXPORT const char *FMI2(fmi2GetVersion)(void)
{
    return "2.0";
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    (void)on;
    (void)count;
    (void)categories;
    return (c != NULL) ? fmi2OK : fmi2Error;
}

static void set_up(struct moment *m)
{
    memset(m, 0, sizeof *m);
    m->setting = SETTINGS;
    m->p = gear_gear;
@input_starts@}

FMI2_EXPORT fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    struct instance *me = NULL;
    (void)resources;
    (void)visible;
    (void)logging;
    if ((name == NULL) || (guid == NULL) || (callbacks == NULL) || (type != fmi2CoSimulation)) {
        return NULL;
    }
    if (strcmp(guid, GUID) != 0) {
        if (callbacks->logger != NULL) {
            callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "logStatusError", "the GUID is that of another model: expected " GUID);
        }
        return NULL;
    }
    me = calloc(1, sizeof *me);
    if (me != NULL) {
        me->callbacks = *callbacks;
        me->name = malloc(strlen(name) + 1u);
        if (me->name != NULL) {
            strcpy(me->name, name);
        }
        set_up(&me->now);
    }
    return me;
}

FMI2_EXPORT void FMI2(fmi2FreeInstance)(fmi2Component c)
{
    struct instance *me = c;
    if (me != NULL) {
        free(me->name);
        free(me);
    }
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop)
{
    struct instance *me = c;
    (void)tolerance_defined;
    (void)tolerance;
    (void)stop_defined;
    (void)stop;
    if ((me == NULL) || !is_number(start)) {
        return fmi2Error;
    }
    me->now.time = start;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2EnterInitializationMode)(fmi2Component c)
{
    return (c != NULL) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2ExitInitializationMode)(fmi2Component c)
{
    struct instance *me = c;
    if (me == NULL) {
        return fmi2Error;
    }
    initialise(&me->now);
    me->now.initialised = 1;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2Terminate)(fmi2Component c)
{
    return (c != NULL) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2Reset)(fmi2Component c)
{
    struct instance *me = c;
    if (me == NULL) {
        return fmi2Error;
    }
    set_up(&me->now);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetReal)(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Real values[])
{
    struct instance *me = c;
    size_t k;
    if (me == NULL) {
        return fmi2Error;
    }
    if (me->now.initialised == 0) {
        /* Outputs follow the inputs until the start. */
        initialise(&me->now);
    }
    for (k = 0u; k < count; ++k) {
        const double *at = input_at(&me->now.input, references[k]);
        if (at == NULL) {
            at = parameter_at(&me->now, references[k]);
        }
        if (at == NULL) {
            switch (references[k]) {
@output_cases@            default:
                return fmi2Error;
            }
        }
        values[k] = *at;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetReal)(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Real values[])
{
    struct instance *me = c;
    bool derives = false;
    size_t k;
    if (me == NULL) {
        return fmi2Error;
    }
    for (k = 0u; k < count; ++k) {
        double *at = input_at(&me->now.input, references[k]);
        if (at == NULL) {
            at = parameter_at(&me->now, references[k]);
            if ((at == NULL) || !is_number(values[k])) {
                return fmi2Error;
            }
            /* An unchanged number changes no bit of what follows from it. */
            derives = derives || ((references[k] < @first_term@) && ((*at < values[k]) || (*at > values[k])));
        }
        *at = values[k];
    }
    if (derives) {
        derive(&me->now);
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetInteger)(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Integer values[])
{
    struct instance *me = c;
    size_t k;
    for (k = 0u; k < count; ++k) {
        if ((me == NULL) || (references[k] != @status@)) {
            return fmi2Error;
        }
        if (me->now.initialised == 0) {
            initialise(&me->now);
        }
        values[k] = (fmi2Integer)me->now.output.flags;
    }
    return fmi2OK;
}

/* There are no values of these types to get or to set: right for none, wrong for any. */
FMI2_EXPORT fmi2Status FMI2(fmi2GetBoolean)(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Boolean values[])
{
    (void)references;
    (void)values;
    return ((c != NULL) && (count == 0u)) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetString)(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2String values[])
{
    (void)references;
    (void)values;
    return ((c != NULL) && (count == 0u)) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetInteger)(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Integer values[])
{
    (void)references;
    (void)values;
    return ((c != NULL) && (count == 0u)) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetBoolean)(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Boolean values[])
{
    (void)references;
    (void)values;
    return ((c != NULL) && (count == 0u)) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetString)(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2String values[])
{
    (void)references;
    (void)values;
    return ((c != NULL) && (count == 0u)) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *to)
{
    struct instance *me = c;
    struct moment *kept;
    if ((me == NULL) || (to == NULL)) {
        return fmi2Error;
    }
    kept = (*to != NULL) ? *to : malloc(sizeof *kept);
    if (kept == NULL) {
        return fmi2Error;
    }
    *kept = me->now;
    *to = kept;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate from)
{
    struct instance *me = c;
    if ((me == NULL) || (from == NULL)) {
        return fmi2Error;
    }
    me->now = *(struct moment *)from;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    if ((c == NULL) || (state == NULL)) {
        return fmi2Error;
    }
    free(*state);
    *state = NULL;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    if ((c == NULL) || (state == NULL) || (size == NULL)) {
        return fmi2Error;
    }
    *size = sizeof(struct moment);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if ((c == NULL) || (state == NULL) || (size < sizeof(struct moment))) {
        return fmi2Error;
    }
    memcpy(bytes, state, sizeof(struct moment));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if ((c == NULL) || (state == NULL) || (size != sizeof(struct moment))) {
        return fmi2Error;
    }
    if (*state == NULL) {
        *state = malloc(sizeof(struct moment));
    }
    if (*state == NULL) {
        return fmi2Error;
    }
    memcpy(*state, bytes, sizeof(struct moment));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[], size_t knowns, const fmi2Real direction[], fmi2Real values[])
{
    (void)c;
    (void)unknown;
    (void)unknowns;
    (void)known;
    (void)knowns;
    (void)direction;
    (void)values;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Integer orders[], const fmi2Real values[])
{
    struct instance *me = c;
    size_t k;
    for (k = 0u; k < count; ++k) {
        double *at = (me != NULL) ? input_at(&me->now.derivative, references[k]) : NULL;
        if ((at == NULL) || (orders[k] != 1) || !is_number(values[k])) {
            return fmi2Error;
        }
        *at = values[k];
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Integer orders[], fmi2Real values[])
{
    (void)c;
    (void)references;
    (void)orders;
    (void)values;
    return (count == 0u) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2DoStep)(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_set_state_before)
{
    static const struct inputs still;
    struct instance *me = c;
    gear_sample sample;
    (void)no_set_state_before;
    if ((me == NULL) || !is_number(time) || !is_number(step) || (step < 0.0)) {
        return fmi2Error;
    }
@move_inputs@    me->now.derivative = still;
    me->now.time = time + step;
    sample = sample_of(&me->now, step);
    me->now.output = gear_step(&me->now.p, &me->now.state, &sample);
    if ((me->now.output.flags & GEAR_REFUSED) != 0u) {
        if (me->callbacks.logger != NULL) {
            me->callbacks.logger(me->callbacks.componentEnvironment, me->name, fmi2Warning, "logStatusWarning", "an input is not finite or absurd: the sample was left out");
        }
        return fmi2Warning;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2CancelStep)(fmi2Component c)
{
    (void)c;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)kind;
    if ((c == NULL) || (value == NULL)) {
        return fmi2Error;
    }
    *value = fmi2OK;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    const struct instance *me = c;
    if ((me == NULL) || (value == NULL) || (kind != fmi2LastSuccessfulTime)) {
        return fmi2Error;
    }
    *value = me->now.time;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if ((c == NULL) || (value == NULL) || (kind != fmi2Terminated)) {
        return fmi2Discard;
    }
    *value = 0;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard;
}
