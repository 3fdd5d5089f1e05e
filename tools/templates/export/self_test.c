/*
 * @title@ Self-test.
 *
 * Made by gmhm @version@ from @file@, SHA-256
 * @hash@.
 * Runs samples whose torques and deflections were computed by the Rust core, and ends with 0 where the source beside it gives the same.
 */
#include "@file_stem@.h"

#include <math.h>
#include <stdio.h>

#define ROWS @count@u
#define TORQUE_TOLERANCE_NM @torque_tolerance@
#define DEFLECTION_TOLERANCE_RAD @deflection_tolerance@

struct golden {
    gear_sample sample;
    real torque_nm;
    real aim_nm;         /* asked of the inverse after this sample */
    real deflection_rad; /* its answer; 0 where there is no inverse */
};

static const struct golden GOLDEN[ROWS] = {
@rows@};

int main(void)
{
    gear_state joint;
    unsigned k;
    unsigned wrong = 0u;
    real worst_torque = 0.0_r;
    real worst_deflection = 0.0_r;

    for (k = 0u; k < ROWS; ++k) {
        const gear_output now = (k == 0u) ? gear_start(&gear_gear, &joint, &GOLDEN[k].sample) : gear_step(&gear_gear, &joint, &GOLDEN[k].sample);
        const real torque_error = fabs_r(now.torque_nm - GOLDEN[k].torque_nm);
        const real inverted = @inverted@;
        const real deflection_error = fabs_r(inverted - GOLDEN[k].deflection_rad);
        worst_torque = (torque_error > worst_torque) ? torque_error : worst_torque;
        worst_deflection = (deflection_error > worst_deflection) ? deflection_error : worst_deflection;
        if (!((torque_error <= TORQUE_TOLERANCE_NM) && (deflection_error <= DEFLECTION_TOLERANCE_RAD))) {
            wrong += 1u;
        }
    }
    (void)printf("%u samples, %u wrong; largest difference %g N*m, %g rad\n", ROWS, wrong, (double)worst_torque, (double)worst_deflection);
    return (wrong == 0u) ? 0 : 1;
}
