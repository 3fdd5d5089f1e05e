/*
 * The inverse, section 5 of the model. The unknown is t = tan(phi / 2), sin(phi) = u = theta / A: u = 2 * t * q, g = 2 * q - 1 with q = 1 / (1 + t^2),
 * so that the tips of the gate are smooth. With the residual r = T* - T, a = q * T_phi and b = q^2 * (T_phiphi - t * T_phi) Euler's step is
 *
 *     dt = r / (a + sqrt(a^2 + 2 * r * b))
 *
 * within a bracket: a step that leaves it is replaced by its middle.
 */
#define GEAR_MOST_STEPS 16u

/* A point of the half circle. */
struct point {
    real t; /* tan(phi / 2) */
    real u; /* sin(phi) */
    real g; /* cos(phi) */
    real q; /* 1 / (1 + t^2) */
};

static struct point point_of(real u, real g)
{
    struct point point;
    point.t = u / (1.0_r + g);
    point.u = u;
    point.g = g;
    point.q = 0.5_r * (1.0_r + g);
    return point;
}

static struct point point_at(real t)
{
    struct point point;
    point.q = 1.0_r / (1.0_r + (t * t));
    point.t = t;
    point.u = (t + t) * point.q;
    point.g = (point.q + point.q) - 1.0_r;
    return point;
}

/* T = P(u) + R(phi): the first two derivatives of P by u, then those of R by phi. */
struct slopes {
    real slope;
    real bend;
    real turn;
    real curl;
};

@stretch@
/* The solution at an edge of the range, the upper (1) or the lower (-1). */
static gear_solution edge_of(const gear_parameters *p, real side)
{
    const gear_solution solution = { (p->reach * p->rated) * side, GEAR_SATURATED };
    return solution;
}

/* What the search ended with; `here` is where the gear is, mirrored by `sign`. No solution lies behind, whatever the rounding. */
static gear_solution solution_of(const gear_parameters *p, real u, uint32_t flags, real sign, real here)
{
    gear_solution solution = { u * p->rated, flags };
    if (flags == GEAR_SATURATED) {
        solution = edge_of(p, (u > 0.0_r) ? sign : -sign);
    } else {
        solution.deflection_rad = ((solution.deflection_rad < here) ? here : solution.deflection_rad) * sign;
    }
    return solution;
}

/* The place of the bracket (t) where a stretch meets the aim; at the start of the search so much torque is missing. */
static gear_solution search(const gear_parameters *p, const struct stretch *stretch, real aim, real missing, const real bracket[2], struct point start, real sign, real here)
{
    const real edge = p->inner_half_tangent;
    real low = bracket[0];
    real high = bracket[1];
    struct point point = start;
    real residual = missing;
    bool low_tried = false;
    bool high_tried = false;
    uint32_t flags = 0u;
    uint32_t steps = 0u;

    while (fabs_r(residual) > p->tolerance) {
        const bool up = residual > 0.0_r;
        struct slopes s;
        real room;
        real by_phi;
        real a;
        real b;
        real predicted;
        real step;
        real next;
        bool follows;

        if (up) {
            if (point.t >= high) {
                if (point.t >= edge) {
                    flags = GEAR_SATURATED;
                }
                break;
            }
            low = point.t;
            low_tried = true;
            room = high - point.t;
        } else {
            if (point.t <= low) {
                if (point.t <= -edge) {
                    flags = GEAR_SATURATED;
                }
                break;
            }
            high = point.t;
            high_tried = true;
            room = point.t - low;
        }
        if (steps == GEAR_MOST_STEPS) {
            flags = GEAR_NOT_CONVERGED;
            break;
        }
        steps += 1u;
        s = stretch_slopes(p, stretch, &point);
        by_phi = (s.slope * point.g) + s.turn;
        a = point.q * by_phi;
        b = (point.q * point.q) * ((((s.bend * (1.0_r - (point.u * point.u))) - (s.slope * point.u)) + s.curl) - (point.t * by_phi));
        predicted = root((a * a) + ((residual + residual) * b));
        step = residual / (a + predicted);
        follows = (a > 0.0_r) && (fabs_r(step) < room);
        if (follows) {
            next = point.t + step;
        } else if ((a > 0.0_r) && !(up ? high_tried : low_tried)) {
            next = up ? high : low;
        } else if ((high - low) <= p->last_width) {
            break;
        } else {
            next = 0.5_r * (low + high);
        }
        point = point_at(next);
        if (follows && (fabs_r(step) <= p->last_step)) {
            break;
        }
        residual = aim - stretch_torque(p, stretch, &point);
        if (follows && (predicted > 0.0_r)) {
            /* Along the tangent, where that is near enough. */
            const real chord = residual / (predicted + predicted);
            const real size = fabs_r(chord);
            if (((((step * step) + size) * size) <= p->last_chord) && (low < (next + chord)) && ((next + chord) < high)) {
                point.u = point.u + ((chord + chord) * (point.q * point.g));
                break;
            }
        }
    }
    return solution_of(p, point.u, flags, sign, here);
}

@solve@
gear_solution gear_invert(const gear_parameters *p, const gear_state *state, real torque_nm@period_argument@)
{
    gear_solution solution = { state->memory.theta, GEAR_REFUSED };
    if ((fabs_r(torque_nm) <= p->largest_torque)@period_check@) {
        solution = solve(p, &state->memory, torque_nm * p->inverse_torque_scale@period_value@);
    }
    return solution;
}
