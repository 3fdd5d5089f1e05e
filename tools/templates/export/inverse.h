
/*
 * The deflection at which the next sample of the base model gives a torque. Nothing moves. Terms are not in it: subtract their torque first.
 * The torque at the solution is the torque asked for within @accuracy@ of T_A, but for the rounding of theta next to +-A.
 */
gear_solution gear_invert(const gear_parameters *p, const gear_state *state, real torque_nm@period_argument@);
