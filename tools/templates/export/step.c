/* Whether a sample can be one at all. */
static bool is_sample(const gear_parameters *p, const gear_sample *sample)
{
    return (fabs_r(sample->deflection_rad) <= p->limit)@finite@;
}
@corrected@@terms@
/* Torques at the deflection that the memory was moved to; where a term has none, the last good output. */
static gear_output finish(@finish_parameters@)
{
    gear_output output = base_output(p, &state->memory);
@add_terms@    if (isfinite(output.torque_nm) != 0) {
        state->last = output;
    } else {
        state->last.flags |= GEAR_REFUSED;
    }
    return state->last;
}

gear_output gear_start(const gear_parameters *p, gear_state *state, const gear_sample *sample)
{
    static const gear_output nothing = { 0.0_r, 0.0_r, 0.0_r, 0.0_r, 0.0_r, 0u };
    static const gear_sample at_rest = { @at_rest@ };
    const bool accepted = is_sample(p, sample);
    const gear_sample *first = accepted ? sample : &at_rest;
    real theta;
    state->last = nothing;
@start_pasts@@start_corrected@    memory_start(p, &state->memory, (fabs_r(theta) <= p->limit) ? theta : 0.0_r);
    (void)finish(@finish_first@);
    if ((!accepted) || (!(fabs_r(theta) <= p->limit))) {
        state->last.flags |= GEAR_REFUSED;
    }
    return state->last;
}

gear_output gear_step(const gear_parameters *p, gear_state *state, const gear_sample *sample)
{
    bool accepted = is_sample(p, sample);
    if (accepted) {
        const real theta = @theta@;
        accepted = fabs_r(theta) <= p->limit;
        if (accepted) {
            memory_step(p, &state->memory, theta@sample_period@);
            (void)finish(@finish_sample@);
        }
    }
    if (!accepted) {
        state->last.flags |= GEAR_REFUSED;
    }
    return state->last;
}
