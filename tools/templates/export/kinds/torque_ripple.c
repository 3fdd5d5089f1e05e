@call torque_ripple($term, $angle)
/* T += sum of B_k * sin(k * q + phi_k). */
static real torque_ripple(const gear_torque_ripple *term, real q)
{
    return harmonics(term->count, term->orders, term->cos_nm, term->sin_nm, q);
}
