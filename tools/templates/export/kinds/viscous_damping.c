@call viscous_damping($term, sample->deflection_rate_rad_per_s)
/* T += b * dtheta/dt. */
static real viscous_damping(const gear_viscous_damping *term, real rate)
{
    return term->damping_nms_per_rad * rate;
}
