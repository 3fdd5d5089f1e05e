/*
 * Law time, section 4 of the model, theta linear between samples, E = exp(-beta * D), D the sample period,
 * phi1 = (1 - E) / (beta * D), phi2 = (1 - phi1) / (beta * D):
 *
 * kernel rate:        m <- E * m + alpha * phi1 * (theta_k - theta_k-1)
 * kernel deflection:  m <- E * m - alpha * D * (phi1 * theta_k-1 + phi2 * (theta_k - theta_k-1))
 */

/* One step of the recursion: what is forgotten, what the last deflection adds and what its increment adds, over A and T_A. */
struct time_step {
    real forgotten;
    real level;
    real increment;
};

static struct time_step step_over(const gear_parameters *p, real period)
{
    const real x = p->beta_per_s * period;
    struct time_step step;
    real phi1;
    real phi2;

    step.forgotten = -expm1_r(-x);
    if (x < 0.125_r) {
        /* The series of phi2: the quotient would lose digits. */
        real term = 0.5_r;
        int k;
        phi2 = term;
        for (k = 3; k <= 10; ++k) {
            term = -((term * x) / (real)k);
            phi2 = phi2 + term;
        }
        phi1 = 1.0_r - (x * phi2);
    } else {
        phi1 = step.forgotten / x;
        phi2 = (1.0_r - phi1) / x;
    }
    if (p->of_rate != 0u) {
        step.level = 0.0_r;
        step.increment = p->gain * phi1;
    } else {
        step.level = -(p->gain * period) * phi1;
        step.increment = -(p->gain * period) * phi2;
    }
    return step;
}

static void memory_start(const gear_parameters *p, gear_memory *memory, real theta)
{
    (void)p;
    memory->theta = theta;
    memory->m = 0.0_r;
    memory->carry = 0.0_r;
}

static void memory_step(const gear_parameters *p, gear_memory *memory, real theta, real period)
{
    const struct time_step step = step_over(p, period);
    const real level = fraction(p, memory->theta);
    const real increment = fraction(p, theta - memory->theta);
    leak(&memory->m, &memory->carry, step.forgotten, (step.level * level) + (step.increment * increment));
    memory->theta = theta;
}

/* z / T_A. */
static real hysteresis(const gear_parameters *p, const gear_memory *memory)
{
    return (p->gated != 0u) ? (gate(p, memory->theta) * memory->m) : memory->m;
}
