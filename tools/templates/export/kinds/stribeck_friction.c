@call stribeck_friction($term, p->sigma, sample->velocity_rad_per_s)
/* T += sigma * ((F_c + (F_s - F_c) * exp(-|v / v_s|^exponent)) * sgn(v) + B * v). */
static real stribeck_friction(const gear_stribeck_friction *term, real sigma, real v)
{
    const real fall = exp_r(-pow_r(fabs_r(v / term->stribeck_velocity_rad_per_s), term->exponent));
    const real dry = term->coulomb_nm + ((term->static_nm - term->coulomb_nm) * fall);
    return sigma * ((dry * sense(v, term->smoothing_rad_per_s)) + (term->damping_nms_per_rad * v));
}
