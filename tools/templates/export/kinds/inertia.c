@call inertia($term, p->sigma, sample->acceleration_rad_per_s2)
/* T += sigma * J * dv/dt. */
static real inertia(const gear_inertia *term, real sigma, real acceleration)
{
    return (sigma * term->inertia_kgm2) * acceleration;
}
