static gear_solution solve(const gear_parameters *p, const gear_memory *memory, real torque, real period)
{
    const struct time_step step = step_over(p, period);
    const real bracket[2] = { -p->inner_half_tangent, p->inner_half_tangent };
    struct point start = point_of(limited(fraction(p, memory->theta), -1.0_r, 1.0_r), gate(p, memory->theta));
    struct stretch stretch;
    real carry = memory->carry;

    stretch.from = fraction(p, memory->theta);
    stretch.m = memory->m;
    leak(&stretch.m, &carry, step.forgotten, step.level * stretch.from);
    stretch.growth = step.increment;
    if (fabs_r(start.t) > bracket[1]) {
        start = point_at(0.0_r);
    }
    return search(p, &stretch, torque, torque - stretch_torque(p, &stretch, &start), bracket, start, 1.0_r, -p->limit);
}

