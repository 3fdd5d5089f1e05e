static gear_solution solve(const gear_parameters *p, const gear_memory *memory, real torque)
{
    const real u = fraction(p, memory->theta);
    const real missing = torque - (elastic(p, u) + hysteresis(p, memory));
    const real sign = (missing > 0.0_r) ? 1.0_r : -1.0_r;
    gear_solution solution = { memory->theta, 0u };

    if ((fabs_r(missing) > p->tolerance) || (fabs_r(u) > p->reach)) {
        struct stretch stretch;
        stretch.from_u = memory->u * sign;
        stretch.from_g = memory->g;
        stretch.transient = transient_towards(p, memory, sign) * sign;
        if (stretch.from_u >= p->reach) {
            solution = edge_of(p, sign);
        } else {
            const bool below = stretch.from_u < -p->reach;
            const struct point start = below ? point_at(-p->inner_half_tangent) : point_of(stretch.from_u, memory->g);
            const real bracket[2] = { start.t, p->inner_half_tangent };
            const real residual = (torque * sign) - stretch_torque(p, &stretch, &start);
            solution = search(p, &stretch, torque * sign, residual, bracket, start, sign, memory->theta * sign);
        }
    }
    return solution;
}

