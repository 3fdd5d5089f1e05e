/*
 * @title@
 *
 * Torque T of a harmonic drive at the torsional deflection theta, and the deflection for a torque.
 * Law @law@, computed in @scalar@. Symbols and equations are those of the model's description (docs/model.md of gmhm).
 *
 * Made by gmhm @version@ from @file@, SHA-256
 * @hash@.
 * Made anew by `gmhm export`, not edited.
@notes@ *
 *     static gear_state joint;
 *     gear_sample sample = { .deflection_rad = q_motor / ratio - q_output - zero };
 *
 *     gear_output now = gear_start(&gear_gear, &joint, &sample);   // once: the past is unknown, z = 0 but for its single-valued part
 *     now = gear_step(&gear_gear, &joint, &sample);                // each control period
@usage@ *
 * Nothing is allocated, no state is kept but in what the caller hands over. Only <math.h> is needed; build with -ffp-contract=off (or -std=c99 of GCC)
 * and without -ffast-math.
 */
#ifndef GEAR_H
#define GEAR_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Flags of outputs and solutions. */
#define GEAR_REFUSED 0x02u       /* the input was NaN, infinite or absurd: nothing moved, the last good output again */
#define GEAR_OUT_OF_RANGE 0x04u  /* beyond the rated deflection the model is not calibrated */
#define GEAR_SATURATED 0x08u     /* beyond the invertible range: the deflection is its edge */
#define GEAR_NOT_CONVERGED 0x10u /* the search ended at its bound; it does not for parameters that were exported */

@defines@
/* One moment of the joint. */
typedef struct gear_sample {
@sample@} gear_sample;

/* Torques at one sample. */
typedef struct gear_output {
    real torque_nm;      /* T = f + z + terms */
    real elastic_nm;     /* f */
    real hysteresis_nm;  /* z */
    real terms_nm;       /* physics beyond the base model */
    real deflection_rad; /* theta, kinematic error and backlash taken out */
    uint32_t flags;
} gear_output;

@solution@@term_types@/* The numbers of one gear. @parameters_words@ */
typedef struct gear_parameters {
@parameters@} gear_parameters;

@law_types@/* The past of one gear. Its content is no concern of the caller. */
typedef struct gear_state {
    gear_memory memory;
@pasts@    gear_output last;
} gear_state;

/* This gear. */
extern const gear_parameters gear_gear;

/* Begins at the first sample: the past is unknown, y = 0 and m = 0, all terms at rest. */
gear_output gear_start(const gear_parameters *p, gear_state *state, const gear_sample *sample);

/* Moves to the next sample. A sample that is refused changes nothing. */
gear_output gear_step(const gear_parameters *p, gear_state *state, const gear_sample *sample);
@invert@
#ifdef __cplusplus
}
#endif

#endif
