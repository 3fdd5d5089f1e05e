@call load_dependent_memory($term, $past, fraction(p, theta), theta)
@past
    bool started;
    real theta;
    real strains[@length@];
@text
/* T += (1 - l_1 - l_2 + l_1 * |u| + l_2 * u^2) * sum of torque_i / r_i * stop_i[theta], u = theta / A, the factor not below 0. */
static real load_dependent_memory(const gear_load_dependent_memory *term, gear_load_dependent_memory_past *past, real u, real theta)
{
    const real step = step_from(&past->started, &past->theta, theta);
    const real size = fabs_r(u);
    const real fall = (1.0_r - size) * (term->load_linear + (term->load_quadratic * (1.0_r + size)));
    const real factor = (fall < 1.0_r) ? (1.0_r - fall) : 0.0_r;
    return factor * slip_elements(term->count, term->radius_rad, term->torque_nm, past->strains, step);
}
