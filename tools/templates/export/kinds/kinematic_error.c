@call kinematic_error($term, $angle)
/* theta_measured = theta + sum of A_k * sin(k * q + phi_k). */
static real kinematic_error(const gear_kinematic_error *term, real q)
{
    return harmonics(term->count, term->orders, term->cos_rad, term->sin_rad, q);
}
