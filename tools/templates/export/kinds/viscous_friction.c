@call viscous_friction($term, p->sigma, sample->velocity_rad_per_s)
/* T += sigma * B * |v / v_1|^exponent * sgn(v) * v_1, v_1 = 1 rad/s. */
static real viscous_friction(const gear_viscous_friction *term, real sigma, real v)
{
    return (sigma * term->damping_nms_per_rad) * (sign_of(v) * pow_r(fabs_r(v), term->exponent));
}
