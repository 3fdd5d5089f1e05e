/* The torque that the gear would transmit at a deflection. Nothing moves. */
static real transmitted(const gear_parameters *p, const gear_memory *memory, real theta, bool starts@period_parameter@)
{
    gear_memory moved = *memory;
    if (starts) {
        memory_start(p, &moved, theta);
    } else {
        memory_step(p, &moved, theta@period_value@);
    }
    return base_output(p, &moved).torque_nm;
}

