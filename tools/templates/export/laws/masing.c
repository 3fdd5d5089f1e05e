/*
 * Law masing, section 3 of the model: z = -e * theta * g(theta) + y, y = h * A * eta over T_A.
 *
 * initial curve from theta_0:      eta = d * 2 * delta * (1 - delta),     delta = |theta - theta_0| / A, 0 for delta > 1
 * branch from a turning point s:   eta = eta_s + d * delta * (2 - delta), delta = |theta - theta_s| / A, 0 for delta > 2
 */

static gear_branch initial_curve(real origin, real sign)
{
    gear_branch branch;
    branch.anchor.theta = origin;
    branch.anchor.eta = 0.0_r;
    branch.slope = 2.0_r;
    branch.bend = sign + sign;
    return branch;
}

static gear_branch branch_from(gear_turning_point anchor, real sign)
{
    gear_branch branch;
    branch.anchor = anchor;
    branch.slope = 2.0_r;
    branch.bend = sign;
    return branch;
}

static real branch_eta(const gear_parameters *p, const gear_branch *branch, real theta)
{
    const real step = fraction(p, theta - branch->anchor.theta);
    return branch->anchor.eta + (step * (branch->slope - smaller(step * branch->bend, 2.0_r)));
}

/* The branch, whose own past was merged, from where it is entered to the turning point that it heads for. */
static gear_branch merged(const gear_parameters *p, gear_branch branch, gear_turning_point entry, gear_turning_point target)
{
    const real begin = fraction(p, entry.theta - branch.anchor.theta);
    const real end = fraction(p, target.theta - branch.anchor.theta);
    const real begin_bent = begin * smaller(begin * branch.bend, 2.0_r);
    const real end_bent = end * smaller(end * branch.bend, 2.0_r);
    const real length = end - begin;
    gear_branch blended = branch;
    if ((length > 0.0_r) || (length < 0.0_r)) {
        blended.slope = ((target.eta - entry.eta) + (end_bent - begin_bent)) / length;
        blended.anchor.eta = (entry.eta - (begin * blended.slope)) + begin_bent;
    }
    return blended;
}

static void memory_start(const gear_parameters *p, gear_memory *memory, real theta)
{
    (void)p;
    memory->theta = theta;
    memory->filtered = theta;
    memory->eta = 0.0_r;
    memory->sign = 0.0_r;
    memory->origin = theta;
    memory->branch = initial_curve(theta, 1.0_r);
    memory->count = 0u;
    memory->merged_pairs = 0u;
    memory->merging = false;
}

/* The last sample becomes a turning point. The first one on the initial curve mirrors itself; a full stack gives up its innermost pair. */
static void turn(gear_memory *memory, real sign, gear_turning_point here)
{
    const bool first = !((memory->sign > 0.0_r) || (memory->sign < 0.0_r));
    memory->sign = sign;
    if (!first) {
        if (memory->count == 0u) {
            memory->points[0].theta = memory->origin + (memory->origin - here.theta);
            memory->points[0].eta = -here.eta;
            memory->count = 1u;
        } else if (memory->count == GEAR_TURNING_POINTS) {
            memory->count -= 2u;
            memory->merging = true;
            if (memory->merged_pairs < UINT32_MAX) {
                memory->merged_pairs += 1u;
            }
        } else {
            /* There is room. */
        }
        memory->points[memory->count] = here;
        memory->count += 1u;
    }
}

/* A movement of the filtered deflection, rising (1) or falling (-1). */
static void move_to(const gear_parameters *p, gear_memory *memory, real theta, real sign)
{
    gear_turning_point entry = { memory->filtered, memory->eta };
    bool enters = (sign * memory->sign) < 1.0_r;
    if (enters) {
        turn(memory, sign, entry);
    }
    /* Wiping out: a loop whose turning point is reached is closed, both its points are dropped, and the outer branch resumes. */
    while ((memory->count >= 2u) && ((memory->points[memory->count - 2u].theta * sign) <= (theta * sign))) {
        entry = memory->points[memory->count - 2u];
        memory->count -= 2u;
        enters = true;
    }
    if (memory->count < 2u) {
        memory->count = 0u;
        memory->merging = false;
    }
    if (enters) {
        if (memory->count == 0u) {
            memory->branch = initial_curve(memory->origin, sign);
        } else {
            memory->branch = branch_from(memory->points[memory->count - 1u], sign);
            if (memory->merging) {
                memory->branch = merged(p, memory->branch, entry, memory->points[memory->count - 2u]);
            }
        }
    }
    memory->filtered = theta;
    memory->eta = branch_eta(p, &memory->branch, theta);
}

static void memory_step(const gear_parameters *p, gear_memory *memory, real theta)
{
    real filtered = theta;
    memory->theta = theta;
    if (p->half_play > 0.0_r) {
        filtered = smaller(larger(memory->filtered, theta - p->half_play), theta + p->half_play);
    }
    if (filtered > memory->filtered) {
        move_to(p, memory, filtered, 1.0_r);
    } else if (filtered < memory->filtered) {
        move_to(p, memory, filtered, -1.0_r);
    } else {
        /* It stays. */
    }
}

/* z / T_A. */
static real hysteresis(const gear_parameters *p, const gear_memory *memory)
{
    return (p->h * memory->eta) - ((p->e * fraction(p, memory->theta)) * gate(p, memory->theta));
}
