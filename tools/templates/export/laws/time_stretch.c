/* The next sample: T = f(u) + z with m = m_ahead + growth * (u - from). */
struct stretch {
    real from;
    real m;
    real growth;
};

/* m, and its first two derivatives by phi. */
static void memory_at(const gear_parameters *p, const struct stretch *s, const struct point *at, real m[3])
{
    (void)p;
    m[0] = s->m + (s->growth * (at->u - s->from));
    m[1] = s->growth * at->g;
    m[2] = -(s->growth * at->u);
}
