/* Feed-forward of one joint from a parameter block: what a drive does once a control period. Prints the motor's lead for a torque that grows. */
#include <math.h>
#include <stdio.h>

#include "gmhm.h"
#include "params.h" /* gmhm pack gear.toml -o params.h */

static gmhm_law law;

int main(void)
{
    const gmhm_limits limits = {1e-3f, 0.5f, INFINITY, INFINITY, INFINITY};
    gmhm_demand demand = {0.0f, 0.0f, 1.0f, 1u, 0u};
    gmhm_contribution now;
    uint16_t code;
    int k;

    if (gmhm_version() != GMHM_VERSION) {
        printf("the header is not that of the library\n");
        return 1;
    }
    code = gmhm_law_init(&law, gmhm_params, sizeof gmhm_params, &limits);
    if (code != GMHM_OK) {
        printf("the block is refused: 0x%04x\n", (unsigned)code);
        return 1;
    }
    for (k = 1; k <= 2000; k++) {
        demand.torque_nm = 0.01f * (float)k;
        if (gmhm_law_step(&law, &demand, &now) & GMHM_FLAG_REFUSED) {
            return 1;
        }
        if (k % 500 == 0) {
            printf("%5.1f N*m: lead %.1f urad, gain %.2f\n", (double)demand.torque_nm, 1e6 * (double)now.offset_rad, (double)now.gain);
        }
    }
    return 0;
}
