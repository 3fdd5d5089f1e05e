/* eta(u) = eta_0 + s * (slope - bend * s), s = u - u_0: every branch, mirrored where the deflection falls so that it always rises. */
struct arc {
    real from;
    real eta;
    real slope;
    real bend; /* 0, 1 or 2 */
};

static real arc_eta(const struct arc *arc, real u)
{
    const real step = u - arc->from;
    return arc->eta + (step * (arc->slope - (step * arc->bend)));
}

static struct arc arc_of(const gear_parameters *p, const gear_branch *branch, real sign)
{
    struct arc arc;
    arc.from = fraction(p, branch->anchor.theta) * sign;
    arc.eta = branch->anchor.eta * sign;
    arc.slope = branch->slope;
    arc.bend = fabs_r(branch->bend);
    return arc;
}

/* By how much the torque at a u of the way is short of the aim. */
static real missing_at(const gear_parameters *p, real aim, real u, real eta)
{
    return (aim - (polynomial(p, u) + (p->h * eta))) + ((p->e * u) * cosine(u));
}

/* The arc that holds the torque, and where on it. */
struct way {
    struct arc arc;
    real high; /* the t up to which the arc holds the torque */
    real from; /* where the search begins, u */
};

/*
 * The way to a torque that lies `missing` above the present one, at the mirrored place `here`: along the branch that the path goes on, or turns to,
 * across the loops that close before the torque is met, to the branch that holds it.
 */
static struct way way_to(const gear_parameters *p, const gear_memory *memory, real sign, real aim, real here, real missing_here)
{
    const real half_play = fraction(p, p->half_play);
    const real reach = p->inner_reach;
    const real play_end = (fraction(p, memory->filtered) * sign) + half_play;
    gear_branch branch = memory->branch;
    gear_turning_point entry = { memory->filtered, memory->eta };
    gear_turning_point target = { 1e30_r * sign, 0.0_r };
    uint32_t count = memory->count; /* of the points that lie outside */
    bool entered = false;
    bool merging = memory->merging;
    bool searches = true;
    real missing = missing_here;
    real low;
    real high;
    real flat_from;
    struct way way;

    if ((sign * memory->sign) < 0.0_r) {
        /* It turns here. A full stack gives up a pair. */
        branch = branch_from(entry, sign);
        entered = true;
        if (count == GEAR_TURNING_POINTS) {
            count -= 2u;
            merging = true;
        }
        if (count > 0u) {
            count -= 1u;
            target = memory->points[count];
        } else {
            target.theta = memory->origin + (memory->origin - entry.theta);
            target.eta = -entry.eta;
        }
    } else if (count >= 2u) {
        count -= 2u;
        target = memory->points[count];
    } else {
        /* The initial curve has no end. */
        count = 0u;
    }
    while (searches) {
        const real place = (fraction(p, target.theta) * sign) + half_play;
        const real short_of = (place < reach) ? missing_at(p, aim, place, target.eta * sign) : 0.0_r;
        searches = short_of > 0.0_r;
        if (searches) {
            /* The loop closes before the torque is met. */
            missing = short_of;
            entry = target;
            entered = count >= 2u;
            if (entered) {
                branch = branch_from(memory->points[count - 1u], sign);
                count -= 2u;
                target = memory->points[count];
            } else {
                branch = initial_curve(memory->origin, sign);
                target.theta = 1e30_r * sign;
                target.eta = 0.0_r;
                searches = false;
            }
        }
    }
    low = larger((fraction(p, entry.theta) * sign) + half_play, here);
    high = smaller((fraction(p, target.theta) * sign) + half_play, reach);
    if (entered && merging) {
        branch = merged(p, branch, entry, target);
    }
    way.arc = arc_of(p, &branch, sign);
    way.arc.from = way.arc.from + half_play;
    flat_from = ((way.arc.from + 1.0_r) + 2.0_r) - way.arc.bend;
    if ((play_end > here) && (missing_at(p, aim, smaller(play_end, reach), memory->eta * sign) <= 0.0_r)) {
        /* Within the play the loop stands still. */
        way.arc.from = 0.0_r;
        way.arc.eta = memory->eta * sign;
        way.arc.slope = 0.0_r;
        way.arc.bend = 0.0_r;
        low = here;
        high = smaller(play_end, reach);
    } else if (flat_from < high) {
        /* The loop ends fully open. */
        if ((low < flat_from) && (missing_at(p, aim, flat_from, arc_eta(&way.arc, flat_from)) <= 0.0_r)) {
            high = flat_from;
        } else {
            way.arc.slope = way.arc.slope - 2.0_r;
            way.arc.bend = 0.0_r;
            low = larger(low, flat_from);
        }
    } else {
        /* The arc holds the torque. */
    }
    way.from = smaller(low + missing, high);
    way.high = (high < reach) ? point_of(high, cosine(high)).t : p->inner_half_tangent;
    return way;
}

/* Whether the path goes on along its branch at least as far as the torque may lie away, as the least slope tells. */
static bool goes_on(const gear_parameters *p, const gear_memory *memory, real sign, real missing)
{
    const gear_branch *branch = &memory->branch;
    bool on = false;
    /* Within the rated deflection: a branch that starts beyond may be fully open before it ends. */
    const bool from_turning_point = (memory->count >= 2u) && ((branch->bend * sign) > 0.0_r);
    if (from_turning_point && (!memory->merging) && (p->half_play <= 0.0_r) && (fabs_r(branch->anchor.theta) <= p->rated)) {
        const real end = smaller(memory->points[memory->count - 2u].theta * sign, p->rated * 0.999999_r);
        on = ((fraction(p, (end * sign) - memory->filtered) * sign) * p->least_slope) > missing;
    }
    return on;
}

static gear_solution solve(const gear_parameters *p, const gear_memory *memory, real torque)
{
    const real u = fraction(p, memory->theta);
    const real g = gate(p, memory->theta);
    const bool outside = fabs_r(u) > p->reach;
    const real missing = torque - ((elastic(p, u) - (p->e * (u * g))) + (p->h * memory->eta));
    const real sign = (missing > 0.0_r) ? 1.0_r : -1.0_r;
    const real here = u * sign;
    const real aim = torque * sign;
    gear_solution solution = { memory->theta, 0u };

    if (outside && (here > 0.0_r)) {
        solution = edge_of(p, sign);
    } else if (outside || (fabs_r(missing) > p->tolerance)) {
        struct way way;
        struct stretch stretch;
        struct point start;
        real bracket[2];
        real bent;
        real residual = fabs_r(missing);
        if (!outside && goes_on(p, memory, sign, fabs_r(missing))) {
            way.arc = arc_of(p, &memory->branch, sign);
            way.high = p->inner_half_tangent;
            way.from = here;
        } else if (outside) {
            /* The way leads through the lower end of the range, where the torque is not known. */
            way = way_to(p, memory, sign, aim, -p->inner_reach, 2.0_r);
        } else {
            way = way_to(p, memory, sign, aim, here, fabs_r(missing));
        }
        bent = way.arc.from * way.arc.bend;
        stretch.level = (p->h * way.arc.eta) - ((p->h * way.arc.from) * (way.arc.slope + bent));
        stretch.linear = p->h * ((way.arc.slope + bent) + bent);
        stretch.quadratic = -(p->h * way.arc.bend);
        start = point_of(way.from, g);
        if ((way.from < here) || (way.from > here)) {
            start = point_of(way.from, cosine(way.from));
            residual = aim - stretch_torque(p, &stretch, &start);
        }
        bracket[0] = -p->inner_half_tangent;
        bracket[1] = way.high;
        solution = search(p, &stretch, aim, residual, bracket, start, sign, memory->theta * sign);
    } else {
        /* The torque is there already. */
    }
    return solution;
}

