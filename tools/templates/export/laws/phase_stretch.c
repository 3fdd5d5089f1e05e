/* One step ahead, mirrored where the deflection falls: T = f(u) + z with m = q * g + s * u + n * exp(-rho * change of phi). */
struct stretch {
    real from_u;
    real from_g;
    real transient;
};

/* m, and its first two derivatives by phi. */
static void memory_at(const gear_parameters *p, const struct stretch *s, const struct point *at, real m[3])
{
    const real faded = s->transient * exp_r(-(p->rho * phase_step(s->from_u, s->from_g, at->u, at->g)));
    const real steady = (p->quadrature * at->g) + (p->in_phase * at->u);
    const real turned = (p->in_phase * at->g) - (p->quadrature * at->u);
    m[0] = steady + faded;
    m[1] = turned - (p->rho * faded);
    m[2] = (p->rho * (p->rho * faded)) - steady;
}
