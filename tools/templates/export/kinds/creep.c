@call creep($term, $past, theta, sample->period_s)
@past
    bool started;
    real theta;
    real strains[@length@];
    real carries[@length@];
@text
/* T += sum of K_j * x_j, x <- E * x + (1 - E) * tau / D * dtheta, E = exp(-D / tau), D the sample period. */
static real creep(const gear_creep *term, gear_creep_past *past, real theta, real period)
{
    const real step = step_from(&past->started, &past->theta, theta);
    real sum = 0.0_r;
    uint32_t k;
    for (k = 0u; k < term->count; ++k) {
        const real x = period / term->tau_s[k];
        const real forgotten = -expm1_r(-x);
        const real kept_of_step = (x > 0.0_r) ? (forgotten / x) : 1.0_r;
        leak(&past->strains[k], &past->carries[k], forgotten, kept_of_step * step);
        sum = sum + (term->stiffness_nm_per_rad[k] * past->strains[k]);
    }
    return sum;
}
