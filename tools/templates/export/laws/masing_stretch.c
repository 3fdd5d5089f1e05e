/* Along one arc: T = f(u) - e * u * g + h * eta(u), h * eta(u) = level + (linear + quadratic * u) * u. */
struct stretch {
    real level;
    real linear;
    real quadratic;
};

static real stretch_torque(const gear_parameters *p, const struct stretch *s, const struct point *at)
{
    const real u = at->u;
    const real square = u * u;
    const real f = u * (((p->k1 + s->linear) + (s->quadratic * u)) + (square * (p->k3 + (square * p->k5))));
    return (s->level + f) - (p->e * (u * at->g));
}

static struct slopes stretch_slopes(const gear_parameters *p, const struct stretch *s, const struct point *at)
{
    const real u = at->u;
    const real square = u * u;
    const real eug = p->e * (u * at->g);
    const real twice = s->quadratic + s->quadratic;
    struct slopes slopes;
    slopes.slope = ((p->k1 + s->linear) + (twice * u)) + (square * (p->three_k3 + (square * p->five_k5)));
    slopes.bend = twice + (u * (p->six_k3 + (square * p->twenty_k5)));
    slopes.turn = p->e * ((square + square) - 1.0_r);
    slopes.curl = (eug + eug) + (eug + eug);
    return slopes;
}
