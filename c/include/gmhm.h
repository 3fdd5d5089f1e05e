/*
 * Hysteresis torque of a harmonic drive, its inverse and its feed-forward, from a parameter block; a store for blocks in flash and the serial link to a host.
 *
 * | type              | what                                                                  |
 * | gmhm_joint        | from deflection to torque and back; with terms in memory of yours     |
 * | gmhm_gear         | from deflection to torque and back, every law without terms: small    |
 * | gmhm_law          | feed-forward of law `masing` without terms: small                     |
 * | gmhm_feed_forward | feed-forward of every law; with terms in memory of yours              |
 * | gmhm_store        | two slots in flash for blocks: one is whole at any moment             |
 * | gmhm_link         | the serial link over a store: read, try, store, go back               |
 *
 * Each lives wherever you put it (statically, as a rule); nothing is allocated and nothing locks. Calls for one of them must not run at the same time: call from one task or interrupt, or
 * mask. No call keeps a pointer, but gmhm_init_with_terms and gmhm_feed_forward_init_with_terms, which keep that of the terms, and gmhm_store_init and gmhm_link_init, which copy gmhm_flash with its functions and its context. No call panics or fails to return, whatever it is given; NULL
 * is answered by GMHM_NULL or GMHM_FLAG_NOT_LOADED. gmhm_init, gmhm_feed_forward_init and their loads take up to 6 KiB of stack, the others less than half.
 *
 *     static gmhm_joint joint;
 *
 *     if (gmhm_init(&joint, block, sizeof block) != GMHM_OK) { ... }          // once, before anything else
 *
 *     gmhm_set_largest_step(&joint, top_speed * period);                      // what moves faster is an outlier; without it, gmhm pack --top-speed
 *
 *     gmhm_sample sample = { .deflection_rad = q_motor / ratio - q_output - zero };   // each control period; ratio and zero: gmhm_get_status. From raw counts: gmhm_step_counts
 *     gmhm_output now;
 *     gmhm_step(&joint, &sample, &now);                                       // now.torque_nm, N*m
 *     gmhm_solution aim;
 *     gmhm_invert(&joint, torque_reference, &sample, &aim);                   // aim.deflection_rad for a torque
 *
 * Make blocks with `gmhm pack model.toml -o params.h` (or .bin, .hex). docs/block.md specifies them.
 * A block that counts torques in amperes of motor current is loaded by gmhm_load_amperes alone, after gmhm_init has answered GMHM_UNIT: read A for N*m everywhere then.
 */
#ifndef GMHM_H
#define GMHM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this header; gmhm_version() is that of the library. */
#define GMHM_VERSION_MAJOR 0
#define GMHM_VERSION_MINOR 1
#define GMHM_VERSION_PATCH 0
#define GMHM_VERSION ((uint32_t)GMHM_VERSION_MAJOR << 16 | (uint32_t)GMHM_VERSION_MINOR << 8 | (uint32_t)GMHM_VERSION_PATCH)
uint32_t gmhm_version(void);

/* Room for one gear with 16 turning points, in 64-bit words: 512 bytes. */
#define GMHM_JOINT_WORDS 64

/* One gear: parameters in force and the path so far. Its content is no concern of yours. */
typedef struct gmhm_joint {
    uint64_t opaque[GMHM_JOINT_WORDS];
} gmhm_joint;

/* Room for one term of any kind, in 64-bit words: 424 bytes. */
#define GMHM_TERM_WORDS 53

/* A place for a term: its coefficients and what it remembers. Its content is no concern of yours. */
typedef struct gmhm_term {
    uint64_t opaque[GMHM_TERM_WORDS];
} gmhm_term;

/* Codes. Refused blocks: 0x0101 to 0x0112, listed in docs/block.md. */
#define GMHM_OK 0x0000u
#define GMHM_NULL 0x0001u
#define GMHM_VALUE 0x0002u /* a number that is none, or out of its range: nothing changed */
#define GMHM_UNIT 0x0003u  /* the block counts torques in the other unit: nothing changed */
#define GMHM_FLASH 0x0004u      /* a function of gmhm_flash failed: what is in force stays whole */
#define GMHM_NO_BLOCK 0x0005u   /* nothing is stored, or nothing before the newest block */
#define GMHM_NOT_NEWER 0x0006u  /* its sequence number is not above that of the newest stored block */
#define GMHM_NO_SPACE 0x0007u   /* the block is longer than the slot or the buffer */
#define GMHM_READ_BACK 0x0008u  /* the flash does not read back what was written */
#define GMHM_PLACE 0x0009u      /* the slots of gmhm_flash are no whole sectors, overlap or lie beyond its end, a function is missing, or the sizes do not go together */
#define GMHM_PERIOD 0x000Au     /* law `time`: the block was made for another control period, see gmhm pack --period */
#define GMHM_NO_INVERSE 0x000Bu /* the block has no inverse: it cannot be fed forward */
#define GMHM_UNREADABLE 0x000Cu /* a slot cannot be read, and no block is known to be in force: nothing was touched, see gmhm_store_erase_unreadable */
#define GMHM_PLACES 0x000Du     /* the block has more terms than there are places: gmhm_block.terms says how many it needs; nothing changed */
#define GMHM_ERROR_LENGTH 0x0101u
#define GMHM_ERROR_MAGIC 0x0102u
#define GMHM_ERROR_VERSION 0x0103u
#define GMHM_ERROR_CHECKSUM 0x0104u
#define GMHM_ERROR_HEADER 0x0105u
#define GMHM_ERROR_SCALAR 0x0106u
#define GMHM_ERROR_STACK_DEPTH 0x0107u
#define GMHM_ERROR_RECORDS 0x0108u
#define GMHM_ERROR_UNKNOWN 0x0109u
#define GMHM_ERROR_MALFORMED 0x010Au
#define GMHM_ERROR_TWICE 0x010Bu
#define GMHM_ERROR_MISSING 0x010Cu
#define GMHM_ERROR_OUT_OF_RANGE 0x010Du
#define GMHM_ERROR_TERM 0x010Eu
#define GMHM_ERROR_NO_ROOM 0x010Fu
#define GMHM_ERROR_NO_TERMS 0x0110u
#define GMHM_ERROR_SELF_TEST 0x0111u /* the golden samples of the block come out otherwise on this processor */
#define GMHM_ERROR_DISAGREES 0x0112u /* the words of the set-up are not those of the gear and the law beside them */

/* Flags of outputs and solutions. */
#define GMHM_FLAG_NOT_LOADED 0x01u    /* no parameters are in force: all numbers are 0 */
#define GMHM_FLAG_REFUSED 0x02u       /* the input was NaN, infinite or absurd: nothing moved, the last good output again */
#define GMHM_FLAG_OUT_OF_RANGE 0x04u  /* beyond the rated deflection the model is not calibrated */
#define GMHM_FLAG_SATURATED 0x08u     /* beyond the invertible range: the deflection is its edge */
#define GMHM_FLAG_NOT_CONVERGED 0x10u /* the search ended at its bound; it does not for parameters that gmhm pack accepts */
#define GMHM_FLAG_NO_INVERSE 0x20u    /* the parameters in force have no inverse */
#define GMHM_FLAG_QUARANTINED 0x40u   /* further from the last sample than gmhm_set_largest_step allows: nothing moved, the last good output again */
#define GMHM_FLAG_RESTARTED 0x80u     /* three quarantined samples agreed: the path starts anew at this one */
#define GMHM_FLAG_NO_ENCODERS 0x100u  /* gmhm_step_counts or gmhm_pair_read without encoders that go with the block */

/* Signals that the terms in force need, bits of gmhm_status.needs. The deflection is always needed. */
#define GMHM_NEEDS_MOTOR_ANGLE 0x01u
#define GMHM_NEEDS_OUTPUT_ANGLE 0x02u
#define GMHM_NEEDS_VELOCITY 0x04u
#define GMHM_NEEDS_ACCELERATION 0x08u
#define GMHM_NEEDS_DEFLECTION_RATE 0x10u
#define GMHM_NEEDS_TEMPERATURE 0x20u
#define GMHM_NEEDS_MOTOR_VELOCITY 0x40u
#define GMHM_NEEDS_OUTPUT_VELOCITY 0x80u

/* One moment of the joint. What gmhm_status.needs does not ask for may stay 0. */
typedef struct gmhm_sample {
    float deflection_rad;            /* q_m/N - q_o, encoder zeros subtracted */
    float motor_angle_rad;           /* q_m, may be reduced to one turn */
    float output_angle_rad;          /* q_o, may be reduced to one turn */
    float deflection_rate_rad_per_s;
    float velocity_rad_per_s;        /* of the output side */
    float acceleration_rad_per_s2;
    float temperature_c;
    float time_s;                    /* since power-up, for slow terms */
    float motor_velocity_rad_per_s;  /* rate of q_m */
    float output_velocity_rad_per_s; /* rate of q_o, on whichever side the torque is taken */
} gmhm_sample;

/* Torques at one sample. */
typedef struct gmhm_output {
    float torque_nm;      /* elastic + hysteresis + terms */
    float elastic_nm;
    float hysteresis_nm;
    float terms_nm;       /* physics beyond the base model; faults of the measurement are never among them */
    float deflection_rad; /* as the base model saw it: kinematic error and backlash taken out */
    uint32_t flags;
} gmhm_output;

/* The deflection for a torque. */
typedef struct gmhm_solution {
    float deflection_rad;
    uint32_t flags;
} gmhm_solution;

/* What is in force. */
typedef struct gmhm_status {
    uint32_t sequence;             /* of the block */
    uint32_t crc32;                /* of the block */
    float period_s;                /* control period that it was made for; 0 where none was stated; that of the limits of a feed-forward */
    float rated_deflection_rad;
    float range_rad;               /* edge of the invertible range; 0 without inverse */
    float start_uncertainty_nm;    /* how far the hysteresis torque may be off because the past before the start is unknown */
    uint32_t merged_pairs;         /* turning points given up because there was no room for more */
    uint32_t needs;
    uint32_t flags;                /* of the last gmhm_step */
    char gear[20];                 /* identity of the gear, ended by a zero */
    float ratio;                   /* N, negative where the gear reverses; 0 where the block states none */
    float deflection_zero_rad;     /* what the encoders show at no deflection: q_m/N - q_o - this is the deflection of a sample */
    uint32_t torque_on_motor_side; /* 1: the torque is taken on the motor side; 0: by a sensor on the output side */
    uint32_t torque_in_amperes;    /* 1: read A for N*m everywhere */
} gmhm_status;

/* What went wrong since gmhm_init or gmhm_clear_diagnostics, or their like of another type. Counters stop at UINT32_MAX. */
typedef struct gmhm_diagnostics {
    uint32_t refused;      /* samples and torques that were NaN, infinite or absurd */
    uint32_t out_of_range; /* samples beyond the rated deflection */
    uint32_t quarantined;  /* samples further from the last one than gmhm_set_largest_step allows */
    uint32_t restarted;    /* new starts where quarantined samples agreed */
    uint32_t saturated;    /* torques asked for beyond the invertible range, by a feed-forward or an inverse */
    uint32_t merged_pairs; /* pairs of turning points given up because there was no room for more */
    uint32_t last_fault;   /* GMHM_FAULT_... */
    uint32_t self_test;    /* of the last block that was loaded: GMHM_SELF_TEST_...; gmhm_clear_diagnostics leaves it */
} gmhm_diagnostics;

#define GMHM_FAULT_NONE 0u
#define GMHM_FAULT_REFUSED 1u
#define GMHM_FAULT_OUT_OF_RANGE 2u
#define GMHM_FAULT_QUARANTINED 3u
#define GMHM_FAULT_RESTARTED 4u
#define GMHM_FAULT_SATURATED 5u
#define GMHM_FAULT_MERGED 6u

/* gmhm_init and gmhm_load compute the golden samples of a block anew. To repeat the test, load the block in force again: the path goes on. */
#define GMHM_SELF_TEST_NOT_RUN 0u /* no block, or one without samples */
#define GMHM_SELF_TEST_PASSED 1u  /* to the bit */
#define GMHM_SELF_TEST_FAILED 2u  /* the block was refused */

/*
 * Makes a joint of bytes that hold anything, and loads a block. Call once, before any other call for this joint. A refused block leaves a joint
 * without parameters, which is safe to use. `length` may be more than that of the block, such as a whole sector of flash. A block with terms is refused by GMHM_PLACES: faults of the
 * measurement apart, which a drive does not compute.
 */
uint16_t gmhm_init(gmhm_joint *joint, const uint8_t *block, uint32_t length);

/*
 * The same with places for terms, at most 255, whatever is in them: for this block and every one that is loaded later. They belong to the joint for as long as it is used. NULL counts as none.
 *
 *     static gmhm_term places[4];
 *     if (gmhm_init_with_terms(&joint, places, 4, block, sizeof block) != GMHM_OK) { ... }
 */
uint16_t gmhm_init_with_terms(gmhm_joint *joint, gmhm_term *terms, uint32_t places, const uint8_t *block, uint32_t length);

/*
 * Puts another block in force while the joint runs. The path goes on: reversals keep their deflections, their torques are computed anew, terms of the same kind go on.
 * The next output is that of the new parameters: fade over to it where it drives a motor. After another gear was mounted, call gmhm_restart as well. A refused block
 * changes nothing: what was in force stays so.
 */
uint16_t gmhm_load(gmhm_joint *joint, const uint8_t *block, uint32_t length);

/* The same for a block that counts torques in amperes; one in newton metres is refused. */
uint16_t gmhm_load_amperes(gmhm_joint *joint, const uint8_t *block, uint32_t length);

/*
 * The same for every block, also one without the words of its set-up, which has no inverse or is older: gmhm_init, gmhm_load and gmhm_load_amperes answer it by
 * GMHM_ERROR_MISSING. A program that calls this function links arithmetic in double precision. In amperes where `in_amperes` is not 0.
 */
uint16_t gmhm_load_any(gmhm_joint *joint, const uint8_t *block, uint32_t length, uint32_t in_amperes);

/* Two encoders. Both must count up, or be reversed, where the deflection of the model grows along the gear; a negative ratio of the block is taken care of. */
typedef struct gmhm_encoders {
    uint32_t motor_counts_per_turn; /* up to 2^30 */
    uint32_t output_counts_per_turn;
    uint32_t motor_reversed; /* 0 or 1 */
    uint32_t output_reversed;
} gmhm_encoders;

/*
 * The largest step of the deflection between two samples, rad, for this joint and every block that it loads: the top speed of the deflection times the control period. What is
 * further from the last good sample is quarantined; for each sample that was not taken the next may lie a step further, up to four. INFINITY means no limit. Until it is called the step is that
 * of the block in force (gmhm pack --top-speed); a block without one sets no limit.
 */
uint16_t gmhm_set_largest_step(gmhm_joint *joint, float largest_step_rad);

/* Forgets the path: the next sample is a start. */
void gmhm_restart(gmhm_joint *joint);

/* Moves to the next sample, one control period after the last. The first one is the start: the hysteresis memory is empty there. Returns the flags, which are in `to` as well. */
uint32_t gmhm_step(gmhm_joint *joint, const gmhm_sample *sample, gmhm_output *to);

/*
 * The deflection at which the next sample gives this torque, terms included, at the angles, speeds and temperature of `sample`, whose deflection is not read. Nothing moves;
 * a torque that is none or beyond the invertible range is counted in the diagnostics.
 * Without a sample (NULL), and before the first step, it is that of the base model alone.
 */
uint32_t gmhm_invert(gmhm_joint *joint, float torque_nm, const gmhm_sample *sample, gmhm_solution *to);

/* What is in force. */
uint32_t gmhm_get_status(const gmhm_joint *joint, gmhm_status *to);

/* What went wrong so far: GMHM_OK, or GMHM_NULL. */
uint16_t gmhm_get_diagnostics(const gmhm_joint *joint, gmhm_diagnostics *to);

/* Counts from nothing again. */
void gmhm_clear_diagnostics(gmhm_joint *joint);

/* The abort code of a CANopen SDO transfer (CiA 301) nearest to a code of this file. */
uint32_t gmhm_sdo_abort(uint16_t code);

/*
 * A gear of any law without terms: 512 bytes, and a fraction of the code of gmhm_joint. It takes blocks of single precision with the words of their set-up (others: GMHM_ERROR_MISSING),
 * leaves their terms aside, and needs no double precision. Its calls are those of gmhm_joint. Raw counts come to it by gmhm_pair.
 *
 *     static gmhm_gear gear;
 *     if (gmhm_gear_init(&gear, block, sizeof block) != GMHM_OK) { ... }
 *     gmhm_gear_set_largest_step(&gear, top_speed * period);
 *
 *     gmhm_gear_step(&gear, q_motor / ratio - q_output - zero, &now);   // each control period; ratio and zero: gmhm_gear_get_status. From raw counts: gmhm_pair_read
 *     gmhm_gear_invert(&gear, torque_reference, &aim);
 */
#define GMHM_GEAR_WORDS 64

typedef struct gmhm_gear {
    uint64_t opaque[GMHM_GEAR_WORDS];
} gmhm_gear;

uint16_t gmhm_gear_init(gmhm_gear *gear, const uint8_t *block, uint32_t length);
uint16_t gmhm_gear_load(gmhm_gear *gear, const uint8_t *block, uint32_t length);
uint16_t gmhm_gear_load_amperes(gmhm_gear *gear, const uint8_t *block, uint32_t length);
uint16_t gmhm_gear_set_largest_step(gmhm_gear *gear, float largest_step_rad);
void gmhm_gear_restart(gmhm_gear *gear);
uint32_t gmhm_gear_step(gmhm_gear *gear, float deflection_rad, gmhm_output *to);
uint32_t gmhm_gear_invert(gmhm_gear *gear, float torque_nm, gmhm_solution *to);
uint32_t gmhm_gear_get_status(const gmhm_gear *gear, gmhm_status *to);
uint16_t gmhm_gear_get_diagnostics(const gmhm_gear *gear, gmhm_diagnostics *to);
void gmhm_gear_clear_diagnostics(gmhm_gear *gear);

/* What a block says of its gear and its joint. */
typedef struct gmhm_block {
    uint32_t length;               /* of the block, bytes */
    uint32_t sequence;
    uint32_t crc32;
    float period_s;                /* control period that it was made for; 0 where none was stated */
    float rated_deflection_rad;    /* 0 for a joint without motor-side angle */
    float torque_scale_nm;         /* 0 likewise */
    char gear[20];                 /* identity of the gear, ended by a zero */
    float ratio;                   /* N, negative where the gear reverses; 0 where the block states none */
    float deflection_zero_rad;     /* what the encoders show at no deflection: q_m/N - q_o - this is the deflection of a sample */
    uint32_t torque_on_motor_side; /* 1: the torque is taken on the motor side; 0: by a sensor on the output side */
    uint32_t torque_in_amperes;    /* 1: read A for N*m everywhere */
    uint32_t terms;                /* places that gmhm_joint and gmhm_feed_forward need for its terms */
} gmhm_block;

/* Reads that from the bytes of a block, for drives that compute by gmhm_law or gmhm_feed_forward. No double precision. A refused block leaves all numbers 0. */
uint16_t gmhm_read_block(const uint8_t *block, uint32_t length, gmhm_block *to);

/*
 * The two encoders of a joint: ratio and zero of the block are applied to raw counts, in integers until the difference is taken.
 *
 *     static gmhm_pair pair;
 *     if (gmhm_pair_init(&pair, block, sizeof block, &encoders) != GMHM_OK) { ... }
 *
 *     gmhm_step_counts(&joint, &pair, motor_counts, output_counts, &sample, &now);   // each control period, for gmhm_joint
 *
 *     gmhm_pair_read(&pair, motor_counts, output_counts, &sample);                   // for gmhm_gear, gmhm_law and gmhm_feed_forward
 *     demand.deflection_rad = sample.deflection_rad;
 */
#define GMHM_PAIR_WORDS 17

typedef struct gmhm_pair {
    uint64_t opaque[GMHM_PAIR_WORDS];
} gmhm_pair;

/* Makes a pair of bytes that hold anything, in integers. GMHM_VALUE where block and encoders do not go together: no ratio, no counts, or too fine. Call it again with every other block, where gmhm_pair_read is used. */
uint16_t gmhm_pair_init(gmhm_pair *pair, const uint8_t *block, uint32_t length, const gmhm_encoders *encoders);

/* The next counts are the first: the shafts may have turned meanwhile. */
uint16_t gmhm_pair_restart(gmhm_pair *pair);

/*
 * Writes deflection and angles of the raw counts, each from 0 to one below a turn, into the sample and leaves its other fields. Between two calls either shaft moves by less than half a turn
 * of its own. Returns 0, or GMHM_FLAG_NO_ENCODERS: nothing is written.
 */
uint32_t gmhm_pair_read(gmhm_pair *pair, uint32_t motor, uint32_t output, gmhm_sample *sample);

/*
 * gmhm_step from raw counts; deflection and angles of the sample are not read. Ratio, zero and rated deflection are those of the block in force, whichever the pair was made with; after
 * gmhm_restart the next counts are the first. GMHM_FLAG_NO_ENCODERS where that block and the encoders do not go together: nothing moved.
 */
uint32_t gmhm_step_counts(gmhm_joint *joint, gmhm_pair *pair, uint32_t motor, uint32_t output, const gmhm_sample *sample, gmhm_output *to);

/*
 * Law `masing` with its feed-forward alone: 512 bytes a joint, and a fraction of the code of gmhm_joint. It takes blocks of single precision in newton metres that
 * gmhm pack has written for law `masing` (others: GMHM_ERROR_MISSING), leaves their terms aside, and needs no double precision.
 *
 *     static gmhm_law law;
 *     gmhm_limits limits = { .period_s = 1e-4f, .ramp_s = 0.5f, .offset_slew_rad_per_s = INFINITY,
 *                            .torque_slew_nm_per_s = INFINITY, .largest_rate_rad_per_s = top_speed };
 *     if (gmhm_law_init(&law, block, sizeof block, &limits) != GMHM_OK) { ... }
 *
 *     gmhm_demand demand = { .torque_nm = torque_reference, .gain_ratio = 1.0f, .on = 1 };   // each control period
 *     gmhm_contribution now;
 *     gmhm_law_step(&law, &demand, &now);
 *     motor_reference = ratio * (output_reference + now.offset_rad);
 */
#define GMHM_LAW_WORDS 64

typedef struct gmhm_law {
    uint64_t opaque[GMHM_LAW_WORDS];
} gmhm_law;

/* How fast the contribution may change. All above zero; the last three may be INFINITY. */
typedef struct gmhm_limits {
    float period_s;               /* control period */
    float ramp_s;                 /* the gain takes this long from 0 to 1 or back, and other parameters to come into force */
    float offset_slew_rad_per_s;
    float torque_slew_nm_per_s;
    float largest_rate_rad_per_s; /* top speed of the deflection; along the measurement, faster samples are quarantined. The lower of this and that of the block counts */
} gmhm_limits;

/* What a period brings. */
typedef struct gmhm_demand {
    float torque_nm;            /* the torque that the gear shall carry: inertia, gravity and contact of the link */
    float deflection_rad;       /* as measured; counts along the measurement only */
    float gain_ratio;           /* share of the contribution, 0 to 1 */
    uint32_t on;                /* 0: the contribution fades to nothing, the memory goes on */
    uint32_t along_measurement; /* 0: the memory follows the torque reference; 1: the measured deflection */
} gmhm_demand;

/* What to feed forward. */
typedef struct gmhm_contribution {
    float offset_rad;          /* add to the output's reference; times the ratio for the motor */
    float change_rad;          /* how much more than in the period before: over the period it is the velocity to feed forward */
    float hysteresis_nm;       /* for a controller that compensates the elastic torque already */
    float gain;                /* in force */
    float certainty;           /* 0 at a start without a past, 1 once the past is known */
    float model_torque_nm;     /* of the gear as the memory has it, whole */
    float model_hysteresis_nm;
    float gear_terms_nm;       /* gmhm_feed_forward: the share of the terms of the gear, which the offset has already */
    float joint_terms_nm;      /* gmhm_feed_forward: friction, ripple, gravity: add to the torque of the motor where the torque is taken on its side; else the offset has it */
} gmhm_contribution;

/* Makes a law of bytes that hold anything, and loads a block. Call once, first. A refused block leaves a law without parameters, which is safe to use. */
uint16_t gmhm_law_init(gmhm_law *law, const uint8_t *block, uint32_t length, const gmhm_limits *limits);

/* Puts another block, or other limits, in force while the loop runs: the contribution goes on from where it is, within ramp and slew. A refusal changes nothing. */
uint16_t gmhm_law_load(gmhm_law *law, const uint8_t *block, uint32_t length, const gmhm_limits *limits);

/* Starts the memory anew at a measured deflection; the contribution goes on from where it is. */
uint16_t gmhm_law_restart(gmhm_law *law, float deflection_rad);

/* One control period: GMHM_FLAG_... REFUSED means that the input was none, and the last good contribution fades. */
uint32_t gmhm_law_step(gmhm_law *law, const gmhm_demand *demand, gmhm_contribution *to);

/* What went wrong so far: GMHM_OK, or GMHM_NULL. Ratio and zero of the block are told by gmhm_read_block and applied by gmhm_pair. */
uint16_t gmhm_law_get_diagnostics(const gmhm_law *law, gmhm_diagnostics *to);
void gmhm_law_clear_diagnostics(gmhm_law *law);

/*
 * Feed-forward of every law with the terms of the block: friction, ripple, gravity and temperature act on what is fed forward. Blocks in newton metres, with an inverse.
 * In law `time` limits->period_s must be the period that the block was made for (GMHM_PERIOD). The block holds the words of its set-up, as `gmhm pack` writes them; one without is
 * answered by GMHM_ERROR_MISSING. Nothing is computed in double precision.
 *
 *     static gmhm_feed_forward feed;
 *     static gmhm_term places[4];
 *     if (gmhm_feed_forward_init_with_terms(&feed, places, 4, block, sizeof block, &limits) != GMHM_OK) { ... }
 *
 *     gmhm_sample sample = { .temperature_c = housing, .velocity_rad_per_s = v, ... };   // what gmhm_feed_forward_needs asks for
 *     gmhm_feed_forward_step(&feed, &demand, &sample, &now);                             // each control period
 */
#define GMHM_FEED_FORWARD_WORDS 64

typedef struct gmhm_feed_forward {
    uint64_t opaque[GMHM_FEED_FORWARD_WORDS];
} gmhm_feed_forward;

/* As gmhm_law_init; a block with terms is refused by GMHM_PLACES. */
uint16_t gmhm_feed_forward_init(gmhm_feed_forward *feed, const uint8_t *block, uint32_t length, const gmhm_limits *limits);

/* The same with places for terms, as gmhm_init_with_terms. */
uint16_t gmhm_feed_forward_init_with_terms(gmhm_feed_forward *feed, gmhm_term *terms, uint32_t places, const uint8_t *block, uint32_t length, const gmhm_limits *limits);

/* As gmhm_law_load: terms of the same kind go on, what all terms add fades over within the ramp. */
uint16_t gmhm_feed_forward_load(gmhm_feed_forward *feed, const uint8_t *block, uint32_t length, const gmhm_limits *limits);

/* As gmhm_law_restart; the terms go on. */
uint16_t gmhm_feed_forward_restart(gmhm_feed_forward *feed, float deflection_rad);

/* The signals of a sample that the terms in force need: GMHM_NEEDS_... */
uint32_t gmhm_feed_forward_needs(const gmhm_feed_forward *feed);

/* One control period. The first sample is the start: its deflection is where the encoders show the gear. Later ones need none. Returns flags as gmhm_law_step. */
uint32_t gmhm_feed_forward_step(gmhm_feed_forward *feed, const gmhm_demand *demand, const gmhm_sample *sample, gmhm_contribution *to);

/* What is in force, ratio and zero of the block included; what went wrong so far. As those of gmhm_joint. */
uint32_t gmhm_feed_forward_get_status(const gmhm_feed_forward *feed, gmhm_status *to);
uint16_t gmhm_feed_forward_get_diagnostics(const gmhm_feed_forward *feed, gmhm_diagnostics *to);
void gmhm_feed_forward_clear_diagnostics(gmhm_feed_forward *feed);

/*
 * A flash and the two slots in it, each a run of whole erase sectors of its own. The functions return 0 when it is done; addresses count from the beginning of the flash. Reads are of any length;
 * writes are aligned runs of 64 bytes into erased sectors, each byte once; erase covers whole sectors from the first address up to the second.
 */
typedef struct gmhm_flash {
    void *context;        /* handed to each function */
    uint32_t capacity;    /* bytes */
    uint32_t erase_size;  /* bytes of an erase sector, a multiple of 64 */
    uint32_t write_size;  /* bytes of the smallest write, a divisor of 64 */
    uint32_t first_slot;  /* address */
    uint32_t second_slot; /* address */
    uint32_t slot_size;   /* bytes */
    uint32_t (*read)(void *context, uint32_t address, uint8_t *to, uint32_t length);
    uint32_t (*write)(void *context, uint32_t address, const uint8_t *from, uint32_t length);
    uint32_t (*erase)(void *context, uint32_t first, uint32_t end);
} gmhm_flash;

/* Gives a block another sequence number, and the CRC-32 that goes with it: a store takes what is above the newest, and gmhm pack writes 0. */
uint16_t gmhm_stamp(uint8_t *block, uint32_t length, uint32_t sequence);

/* Blocks in two slots: a power cut at any moment leaves the old block or the new one whole. */
#define GMHM_STORE_WORDS 24

typedef struct gmhm_store {
    uint64_t opaque[GMHM_STORE_WORDS];
} gmhm_store;

/* Makes a store of bytes that hold anything. GMHM_PLACE where the slots cannot be. Nothing is read or written yet. */
uint16_t gmhm_store_init(gmhm_store *store, const gmhm_flash *flash);

/* Copies the newest whole block, for gmhm_init or gmhm_load. Call it at boot: its slot counts as the one in force from then on and is never written over. */
uint16_t gmhm_store_read(gmhm_store *store, uint8_t *to, uint32_t room, uint32_t *length);

/* Stores a block beside the one in force, reads it back, and makes it the newest. Takes as long as the flash takes to erase a slot.
   GMHM_UNREADABLE where a slot cannot be read and no block is known to be in force: read the newest block first, or switch power off and on. */
uint16_t gmhm_store_write(gmhm_store *store, const uint8_t *block, uint32_t length);

/* Erases the newest block: the one before it is the newest again. */
uint16_t gmhm_store_roll_back(gmhm_store *store);

/* Erases each slot that gives nothing but read errors, never one that reads, nor that of the block in force: the way out of GMHM_UNREADABLE where a slot does not
   read again after power was switched off and on (flash with error correction, after an interrupted erase). A block that lay in it is lost. */
uint16_t gmhm_store_erase_unreadable(gmhm_store *store);

/* What a drive measures and computes, for a host that watches. */
typedef struct gmhm_live {
    float deflection_rad;
    float torque_nm;
    float hysteresis_nm;
    float contribution_nm; /* what the compensation adds to the command */
    uint32_t flags;        /* of the last step */
    uint32_t ticks;        /* control periods so far; wraps */
    uint32_t loop_cost;    /* what the last one took, in counts of the drive's own clock */
} gmhm_live;

/* The drive behind a link. The functions are called from within the calls of gmhm_link; any but send and adopt may be NULL. */
typedef struct gmhm_drive {
    void *context; /* handed to each function */
    /* Sends bytes to the host. */
    void (*send)(void *context, const uint8_t *bytes, uint32_t length);
    /* Puts a block in force, by gmhm_load, gmhm_feed_forward_load or both with the control interrupt masked; none where block is NULL. What is not GMHM_OK refuses it: what was in force stays. */
    uint16_t (*adopt)(void *context, const uint8_t *block, uint32_t length);
    /* 1 while the power stage is on: nothing is stored then. A drive without this function counts as enabled. */
    uint32_t (*is_enabled)(void *context);
    /* Switches the compensation: gmhm_demand.on and .gain_ratio. */
    void (*set_compensation)(void *context, uint32_t on, float gain_ratio);
    void (*get_live)(void *context, gmhm_live *to);
    void (*get_diagnostics)(void *context, gmhm_diagnostics *to);
    void (*clear_diagnostics)(void *context);
} gmhm_drive;

/* The drive's end of the serial link (docs/link.md) over a store, with room for a block of 2048 bytes. Call it outside the control interrupt. */
#define GMHM_LINK_WORDS 352

typedef struct gmhm_link {
    uint64_t opaque[GMHM_LINK_WORDS];
} gmhm_link;

/* Makes a link of bytes that hold anything. `nonce` should differ from one power-up to the next: it tells sessions apart. */
uint16_t gmhm_link_init(gmhm_link *link, const gmhm_flash *flash, uint32_t nonce);

/*
 * Locks the link: each request that changes something must prove that its host knows the key (docs/link.md, access); gmhm drive and gmhm flash take it by --key. Call it after gmhm_link_init and
 * before the first gmhm_link_receive. `entropy` must differ at every power-up: random numbers, or a counter that is stored. GMHM_NULL leaves the link open: check the answer. A program that does
 * not call this function links no cryptography.
 */
#define GMHM_KEY_BYTES 32
#define GMHM_ENTROPY_BYTES 16
uint16_t gmhm_link_lock(gmhm_link *link, const uint8_t key[GMHM_KEY_BYTES], const uint8_t entropy[GMHM_ENTROPY_BYTES]);

/* Puts the newest stored block in force that the drive adopts. GMHM_NO_BLOCK where nothing is stored, else why the newest one was refused. */
uint16_t gmhm_link_boot(gmhm_link *link, const gmhm_drive *drive);

/* Takes bytes from the line and sends the answers. */
uint16_t gmhm_link_receive(gmhm_link *link, const gmhm_drive *drive, const uint8_t *bytes, uint32_t length);

/* Says that time has passed, some times a second: a trial whose host is gone ends, a silent session may be taken over. */
uint16_t gmhm_link_elapse(gmhm_link *link, const gmhm_drive *drive, uint32_t ms);

#ifdef __cplusplus
}
#endif

#endif
