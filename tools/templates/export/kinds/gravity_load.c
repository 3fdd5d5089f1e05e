@call gravity_load($term, sample->output_angle_rad)
/* T += G * sin(q_o + phi). */
static real gravity_load(const gear_gravity_load *term, real q)
{
    return (term->cos_nm * cos_r(q)) + (term->sin_nm * sin_r(q));
}
