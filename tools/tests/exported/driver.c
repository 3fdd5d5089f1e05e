/* Runs an exported gear (prefix `gear`) over samples and torques from standard input; writes torques and deflections to standard output, all in binary. */
#include "gear.h"

#include <stdio.h>

struct row {
    gear_sample sample;
    REAL aim;
};

struct answer {
    gear_output output;
#ifdef INVERTS
    gear_solution solution;
#endif
};

int main(void)
{
    static gear_state joint;
    struct row row;
    int started = 0;
    while (fread(&row, sizeof row, 1, stdin) == 1) {
        struct answer answer;
        answer.output = started ? gear_step(&gear_gear, &joint, &row.sample) : gear_start(&gear_gear, &joint, &row.sample);
        started = 1;
#ifdef INVERTS
#ifdef GEAR_LONGEST_PERIOD_S
        answer.solution = gear_invert(&gear_gear, &joint, row.aim, row.sample.period_s);
#else
        answer.solution = gear_invert(&gear_gear, &joint, row.aim);
#endif
#endif
        if (fwrite(&answer, sizeof answer, 1, stdout) != 1) {
            return 1;
        }
    }
    return 0;
}
