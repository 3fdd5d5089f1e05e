@call thermal_friction($term, sample->temperature_c)
/* All friction terms times exp(-kappa * (Theta - Theta_0)). */
static real thermal_friction(const gear_thermal_friction *term, real temperature)
{
    return exp_r(-(term->per_k * (temperature - term->reference_c)));
}
