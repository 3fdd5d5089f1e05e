@call nonlocal_memory($term, $past, theta)
@past
    bool started;
    real theta;
    real strains[@length@];
@text
/* T += sum of torque_i / r_i * stop_i[theta]. */
static real nonlocal_memory(const gear_nonlocal_memory *term, gear_nonlocal_memory_past *past, real theta)
{
    const real step = step_from(&past->started, &past->theta, theta);
    return slip_elements(term->count, term->radius_rad, term->torque_nm, past->strains, step);
}
