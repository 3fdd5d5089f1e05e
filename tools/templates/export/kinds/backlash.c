@call backlash($term, $past, p, &state->memory, theta@starts@@period@)
@past
    bool started;
    bool falling; /* the side of the last contact */
    real theta;
@text
/* The zero crossing of the torque between two deflections, by false position (Illinois); where the parts are if it is zero there already. */
static real crossing(const gear_backlash_past *past, const gear_parameters *p, const gear_memory *memory, const real ends[2], const real torques[2], bool starts@period_parameter@)
{
    const real tolerance = @crossing_tolerance@ * (torques[1] - torques[0]);
    real low = ends[0];
    real high = ends[1];
    real low_torque = torques[0];
    real high_torque = torques[1];
    bool guesses = past->started && (low <= past->theta) && (past->theta <= high);
    real kept = 0.0_r;
    real theta = low;
    uint32_t trial;

    for (trial = 0u; trial < 64u; ++trial) {
        const real slope = high_torque - low_torque;
        const real secant = (slope > 0.0_r) ? (low - ((low_torque * (high - low)) / slope)) : low;
        const bool guessed = guesses;
        real torque;
        real sense_of;
        theta = limited(guessed ? past->theta : secant, low, high);
        guesses = false;
        torque = transmitted(p, memory, theta, starts@period_value@);
        if (fabs_r(torque) <= tolerance) {
            break;
        }
        sense_of = (torque < 0.0_r) ? -1.0_r : 1.0_r;
        if ((!guessed) && (!((((torque < 0.0_r) ? low : high) < theta) || (((torque < 0.0_r) ? low : high) > theta)))) {
            break;
        }
        if (torque < 0.0_r) {
            low = theta;
            low_torque = torque;
        } else {
            high = theta;
            high_torque = torque;
        }
        /* The same end twice: the other one counts half. */
        if ((kept * sense_of) > 0.0_r) {
            if (sense_of > 0.0_r) {
                low_torque = 0.5_r * low_torque;
            } else {
                high_torque = 0.5_r * high_torque;
            }
        }
        kept = sense_of;
    }
    return theta;
}

/* Clearance: theta_measured = theta + b * sgn(T); in the gap T = 0. Play: theta <- limited(theta, theta_measured - b, theta_measured + b). */
static real backlash(const gear_backlash *term, gear_backlash_past *past, const gear_parameters *p, const gear_memory *memory, real measured, bool starts@period_parameter@)
{
    const real ends[2] = { measured - term->half_gap_rad, measured + term->half_gap_rad };
    real theta = measured;
    if (term->half_gap_rad > 0.0_r) {
        if (term->shape != 0u) {
            theta = limited(past->started ? past->theta : measured, ends[0], ends[1]);
        } else {
            real torques[2] = { 0.0_r, 0.0_r };
            bool in_contact = false;
            uint32_t trial;
            /* The side of the last contact first: mostly it still holds. */
            for (trial = 0u; (trial < 2u) && (!in_contact); ++trial) {
                const bool falling = (trial == 0u) ? past->falling : !past->falling;
                const real end = falling ? ends[1] : ends[0];
                const real torque = transmitted(p, memory, end, starts@period_value@);
                torques[falling ? 1 : 0] = torque;
                in_contact = falling ? (torque < 0.0_r) : (torque > 0.0_r);
                if (in_contact) {
                    past->falling = falling;
                    theta = end;
                } else if (trial == 1u) {
                    break;
                } else {
                    /* The other side. */
                }
            }
            if (!in_contact) {
                theta = crossing(past, p, memory, ends, torques, starts@period_value@);
            }
        }
        past->started = true;
        past->theta = theta;
    }
    return theta;
}
