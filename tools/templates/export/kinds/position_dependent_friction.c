@call position_dependent_friction($term, p->sigma, $angle, sample->velocity_rad_per_s)
/* T += sigma * (sum of F_k * cos(k * q + phi_k)) * sgn(v). */
static real position_dependent_friction(const gear_position_dependent_friction *term, real sigma, real q, real v)
{
    return (sigma * harmonics(term->count, term->orders, term->cos_nm, term->sin_nm, q)) * sense(v, term->smoothing_rad_per_s);
}
