@call thermal_stiffness($term, p->c1, theta, sample->temperature_c)
/* T -= kappa * c1 * theta * (Theta - Theta_0). */
static real thermal_stiffness(const gear_thermal_stiffness *term, real c1, real theta, real temperature)
{
    return ((-(term->per_k * c1)) * theta) * (temperature - term->reference_c);
}
