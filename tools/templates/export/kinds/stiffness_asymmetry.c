@call stiffness_asymmetry($term, theta)
/* T += k * theta^2, or k * |theta|. */
static real stiffness_asymmetry(const gear_stiffness_asymmetry *term, real theta)
{
    return (term->shape == 0u) ? ((term->stiffness_nm_per_rad2 * theta) * theta) : (term->stiffness_nm_per_rad * fabs_r(theta));
}
