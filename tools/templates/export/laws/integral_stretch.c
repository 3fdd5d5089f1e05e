
/* z of m by the gate. */
static real gated(const gear_parameters *p, real g, real m)
{
    return (p->gated != 0u) ? (g * m) : m;
}

static real stretch_torque(const gear_parameters *p, const struct stretch *s, const struct point *at)
{
    real m[3];
    memory_at(p, s, at, m);
    return polynomial(p, at->u) + gated(p, at->g, m[0]);
}

static struct slopes stretch_slopes(const gear_parameters *p, const struct stretch *s, const struct point *at)
{
    const real square = at->u * at->u;
    struct slopes slopes;
    real m[3];
    memory_at(p, s, at, m);
    slopes.slope = p->k1 + (square * (p->three_k3 + (square * p->five_k5)));
    slopes.bend = at->u * (p->six_k3 + (square * p->twenty_k5));
    slopes.turn = m[1];
    slopes.curl = m[2];
    if (p->gated != 0u) {
        slopes.turn = (at->g * m[1]) - (at->u * m[0]);
        slopes.curl = (at->g * (m[2] - m[0])) - ((at->u * m[1]) + (at->u * m[1]));
    }
    return slopes;
}
