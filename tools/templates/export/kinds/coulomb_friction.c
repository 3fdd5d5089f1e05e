@call coulomb_friction($term, p->sigma, sample->velocity_rad_per_s)
/* T += sigma * F_c * tanh(v / v_s). */
static real coulomb_friction(const gear_coulomb_friction *term, real sigma, real v)
{
    return (sigma * term->torque_nm) * sense(v, term->smoothing_rad_per_s);
}
