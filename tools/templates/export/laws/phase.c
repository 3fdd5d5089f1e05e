/*
 * Law phase, section 4 of the model: m = q * d * g + s * u + n, u = sin(phi), g = cos(phi).
 *
 * n <- n * exp(-rho * |change of phi|), and n <- n + q * g * (d_old - d_new) where the direction turns.
 */

/* The transient that a movement in a direction starts from. */
static real transient_towards(const gear_parameters *p, const gear_memory *memory, real direction)
{
    return memory->transient + ((p->quadrature * memory->g) * (memory->direction - direction));
}

/* The angle from (u_0, g_0) to (u, g) on the unit circle, 0 to pi. */
static real phase_step(real u0, real g0, real u, real g)
{
    const real across = fabs_r((u * g0) - (u0 * g));
    const real along = (u * u0) + (g * g0);
    return ((across < 0.5_r) && (along > 0.0_r)) ? asin_r(across) : atan2_r(across, along);
}

static void memory_start(const gear_parameters *p, gear_memory *memory, real theta)
{
    memory->theta = theta;
    memory->u = limited(fraction(p, theta), -1.0_r, 1.0_r);
    memory->g = gate(p, theta);
    memory->direction = 0.0_r;
    memory->transient = -(p->in_phase * memory->u);
}

/* A movement, rising (1) or falling (-1). */
static void move_to(const gear_parameters *p, gear_memory *memory, real theta, real direction)
{
    const real u = limited(fraction(p, theta), -1.0_r, 1.0_r);
    const real g = gate(p, theta);
    if ((direction * memory->direction) < 1.0_r) {
        memory->transient = transient_towards(p, memory, direction);
        memory->direction = direction;
    }
    memory->transient = memory->transient * exp_r(-(p->rho * phase_step(memory->u, memory->g, u, g)));
    memory->theta = theta;
    memory->u = u;
    memory->g = g;
}

static void memory_step(const gear_parameters *p, gear_memory *memory, real theta)
{
    if (theta > memory->theta) {
        move_to(p, memory, theta, 1.0_r);
    } else if (theta < memory->theta) {
        move_to(p, memory, theta, -1.0_r);
    } else {
        /* It stays. */
    }
}

/* z / T_A. */
static real hysteresis(const gear_parameters *p, const gear_memory *memory)
{
    const real m = (((p->quadrature * memory->direction) * memory->g) + (p->in_phase * memory->u)) + memory->transient;
    return (p->gated != 0u) ? (memory->g * m) : m;
}
