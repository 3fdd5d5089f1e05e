/* T over T_A at the deflection that the memory was moved to. */
static gear_output base_output(const gear_parameters *p, const gear_memory *memory)
{
    const real f = elastic(p, fraction(p, memory->theta));
    const real z = hysteresis(p, memory);
    gear_output output;
    output.torque_nm = (f + z) * p->scale_nm;
    output.elastic_nm = f * p->scale_nm;
    output.hysteresis_nm = z * p->scale_nm;
    output.terms_nm = 0.0_r;
    output.deflection_rad = memory->theta;
    output.flags = 0u;
    if (fabs_r(memory->theta) > p->rated) {
        output.flags = GEAR_OUT_OF_RANGE;
    }
    return output;
}
