@call presliding_friction($term, $past, p->sigma, sample->output_angle_rad)
@past
    bool started;
    real angle;
    real strain; /* D */
@text
/* T += sigma * F * D, dD/dq = (1 - D * sgn(v)) / r along the output: D <- s + (D - s) * exp(-|dq| / r) over a step dq in the direction s. */
static real presliding_friction(const gear_presliding_friction *term, gear_presliding_friction_past *past, real sigma, real q)
{
    real step = step_from(&past->started, &past->angle, q);
    if (fabs_r(step) > GEAR_PI) {
        /* The angle was reduced to one turn in between. */
        step = whole_turns_less(step);
    }
    past->strain = past->strain - ((sign_of(step) - past->strain) * expm1_r(-(fabs_r(step) / term->radius_rad)));
    return (sigma * term->torque_nm) * past->strain;
}
