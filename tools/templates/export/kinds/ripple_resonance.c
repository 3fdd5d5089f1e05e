@call ripple_resonance($term, $angle, $speed)
/*
 * T += sum of Re(H(j * k * dq/dt) * C_k * exp(j * k * q)), H(s) = w^2 / (s^2 + 2 * zeta * w * s + w^2): with x = k * (dq/dt) / w, a wave's value p and quadrature r,
 * each order adds ((1 - x^2) * p + 2 * zeta * x * r) / ((1 - x^2)^2 + (2 * zeta * x)^2).
 */
static real ripple_resonance(const gear_ripple_resonance *term, real q, real speed)
{
    const real within = whole_turns_less(q);
    real sum = 0.0_r;
    uint32_t k;
    for (k = 0u; k < term->count; ++k) {
        const real order = term->orders[k];
        const real angle = order * (is_whole(order) ? within : q);
        const real in_phase = (term->cos_nm[k] * cos_r(angle)) + (term->sin_nm[k] * sin_r(angle));
        const real quadrature = (term->cos_nm[k] * sin_r(angle)) - (term->sin_nm[k] * cos_r(angle));
        const real x = (order * speed) / ((2.0_r * GEAR_PI) * term->frequency_hz);
        const real elastic_part = (1.0_r - x) * (1.0_r + x);
        const real damping = (2.0_r * term->damping_ratio) * x;
        sum = sum + (((elastic_part * in_phase) + (damping * quadrature)) / ((elastic_part * elastic_part) + (damping * damping)));
    }
    return sum;
}
