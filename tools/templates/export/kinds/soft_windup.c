@call soft_windup($term, theta)
/*
 * T -= dK * w * s(theta / w) with s(x) = tanh(x), x / (1 + x^2) or x * exp(-x^2 / 2), or K3 * theta - P(theta), P with the slopes K1, K2, K3 and
 * kinks at T1 and T2.
 */
static real soft_windup(const gear_soft_windup *term, real theta)
{
    real drop;
    if (term->shape == 3u) {
        const real end_1 = term->t1_nm / term->k1_nm_per_rad;
        const real end_2 = (term->t2_nm - term->t1_nm) / term->k2_nm_per_rad;
        const real first = limited(theta, -end_1, end_1);
        const real second = limited(theta - first, -end_2, end_2);
        drop = ((term->k3_nm_per_rad - term->k1_nm_per_rad) * first) + ((term->k3_nm_per_rad - term->k2_nm_per_rad) * second);
    } else {
        const real x = theta / term->width_rad;
        real s;
        if (term->shape == 0u) {
            s = tanh_r(x);
        } else if (term->shape == 1u) {
            s = x / (1.0_r + (x * x));
        } else {
            s = x * exp_r(-((0.5_r * x) * x));
        }
        drop = (term->stiffness_drop_nm_per_rad * term->width_rad) * s;
    }
    return -drop;
}
