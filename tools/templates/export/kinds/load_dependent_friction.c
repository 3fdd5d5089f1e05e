@call load_dependent_friction($term, p->sigma, base_torque, sample->velocity_rad_per_s)
/* T += sigma * mu * |T_base| * sgn(v). */
static real load_dependent_friction(const gear_load_dependent_friction *term, real sigma, real base_torque, real v)
{
    return ((sigma * term->mu) * fabs_r(base_torque)) * sense(v, term->smoothing_rad_per_s);
}
