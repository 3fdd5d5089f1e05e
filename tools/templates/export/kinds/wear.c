@call wear($term, theta, sample->time_s)
/* T -= dK * theta * s(t), s a step at t_0 or a ramp from t_0 to t_0 + duration. */
static real wear(const gear_wear *term, real theta, real time)
{
    const real since = time - term->start_s;
    real worn = (since >= 0.0_r) ? 1.0_r : 0.0_r;
    if ((term->shape == 1u) && (term->duration_s > 0.0_r)) {
        worn = limited(since / term->duration_s, 0.0_r, 1.0_r);
    }
    return -((term->stiffness_drop_nm_per_rad * theta) * worn);
}
