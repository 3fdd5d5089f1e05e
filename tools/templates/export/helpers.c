@helper GEAR_PI
#define GEAR_PI 3.141592653589793_r
@helper smaller
static real smaller(real a, real b)
{
    return (a < b) ? a : b;
}
@helper larger
static real larger(real a, real b)
{
    return (a > b) ? a : b;
}
@helper limited
static real limited(real x, real low, real high)
{
    return (x < low) ? low : ((x > high) ? high : x);
}
@helper root
/* The square root, 0 where there is none. */
static real root(real x)
{
    return (x > 0.0_r) ? sqrt_r(x) : 0.0_r;
}
@helper fraction
/* A deflection, or a difference of two, over A. */
static real fraction(const gear_parameters *p, real theta)
{
    return theta * p->inverse_rated;
}
@helper gate
/* g = sqrt(max(0, (1 - theta / A) * (1 + theta / A))): A -+ theta is exact near the tips. */
static real gate(const gear_parameters *p, real theta)
{
    return root(fraction(p, p->rated - theta) * fraction(p, p->rated + theta));
}
@helper cosine
/* g of u. */
static real cosine(real u)
{
    return root((1.0_r - u) * (1.0_r + u));
}
@helper polynomial
/* f over T_A up to kappa: k1 * u + k3 * u^3 + k5 * u^5. */
static real polynomial(const gear_parameters *p, real u)
{
    const real square = u * u;
    return u * (p->k1 + (square * (p->k3 + (square * p->k5))));
}
@helper elastic
/* f over T_A: the polynomial, beyond kappa its tangent there. */
static real elastic(const gear_parameters *p, real u)
{
    const real size = fabs_r(u);
    real torque;
    if (size <= p->knee) {
        torque = polynomial(p, u);
    } else {
        torque = p->knee_torque + ((size - p->knee) * p->knee_stiffness);
        torque = (u < 0.0_r) ? -torque : torque;
    }
    return torque;
}
@helper leak
/* x <- x - forgotten * x + added. What the sum rounds off is carried to the next call (Kahan), so that nothing drifts. */
static void leak(real *x, real *carry, real forgotten, real added)
{
    const real change = (added - (forgotten * *x)) + *carry;
    const real sum = *x + change;
    *carry = change - (sum - *x);
    *x = sum;
}
@helper sign_of
static real sign_of(real x)
{
    return (x > 0.0_r) ? 1.0_r : ((x < 0.0_r) ? -1.0_r : 0.0_r);
}
@helper sense
/* sgn(v), smoothed as tanh(v / smoothing) where that is above 0. */
static real sense(real v, real smoothing)
{
    return (smoothing > 0.0_r) ? tanh_r(v / smoothing) : sign_of(v);
}
@helper is_whole
static bool is_whole(real x)
{
    return fabs_r(x - floor_r(x + 0.5_r)) <= 0.0_r;
}
@helper whole_turns_less
#define GEAR_TURNS_PER_RAD 0.15915494309189535_r /* 1 / (2 * pi) */
#define GEAR_TURN_1 @turn_1@
#define GEAR_TURN_2 @turn_2@
#define GEAR_TURN_3 @turn_3@
/* An angle less whole turns; 2 * pi in three pieces, of which multiples by a number of turns are exact. */
static real whole_turns_less(real q)
{
    const real turns = floor_r((q * GEAR_TURNS_PER_RAD) + 0.5_r);
    return ((q - (turns * GEAR_TURN_1)) - (turns * GEAR_TURN_2)) - (turns * GEAR_TURN_3);
}
@helper harmonics
/* The sum of c_k * cos(k * q) + s_k * sin(k * q). Whole orders take the angle less whole turns, which keeps its digits. */
static real harmonics(uint32_t count, const real orders[], const real c[], const real s[], real q)
{
    const real within = whole_turns_less(q);
    real sum = 0.0_r;
    uint32_t k;
    for (k = 0u; k < count; ++k) {
        const real angle = orders[k] * (is_whole(orders[k]) ? within : q);
        sum = (sum + (c[k] * cos_r(angle))) + (s[k] * sin_r(angle));
    }
    return sum;
}
@helper slip_elements
/* Springs in parallel of stiffness torque / radius that slip at their torques: s <- limited(s + d theta, -r, r). */
static real slip_elements(uint32_t count, const real radius[], const real torque[], real strains[], real step)
{
    real sum = 0.0_r;
    uint32_t k;
    for (k = 0u; k < count; ++k) {
        strains[k] = limited(strains[k] + step, -radius[k], radius[k]);
        sum = sum + ((torque[k] / radius[k]) * strains[k]);
    }
    return sum;
}
@helper step_from
/* How far a path went since the last call; 0 at its start. */
static real step_from(bool *started, real *last, real now)
{
    const real step = *started ? (now - *last) : 0.0_r;
    *started = true;
    *last = now;
    return step;
}
