/* The fields of all structs that cross the border of the core, once. C, numpy and JavaScript are
   made of this list: nobody else says where a field lies. Who adds, moves or resizes one raises
   FL_VERSION.

   FL_FIELD(type, name, shape, unit, meaning). An offset is that of a table in the block: it counts
   numbers from the first one, and is 0 where there is no table.

   What is in a block is fl_real, counts and flags too, so that a block is an array of one type that
   Python and JavaScript make and keep without packing, and that -DFL_SINGLE converts number by
   number. */
FL_BEGIN(fl_head)
FL_FIELD(fl_real, magic, , "1", "FL_MAGIC")
FL_FIELD(fl_real, version, , "1", "FL_VERSION")
FL_FIELD(fl_real, length, , "1", "numbers in the block")
FL_FIELD(fl_real, n, , "1", "actuators")
FL_FIELD(fl_real, rank, , "1", "r, rank of the effectiveness")
FL_FIELD(fl_real, axis_scale, [6], "N, N m", "wrench = axis_scale * scaled wrench")
FL_FIELD(fl_real, wrench_scale, [6], "N, N m", "sigma, by which errors are normalized")
FL_FIELD(fl_real, is_commanded, [6], "1", "1 of an axis that the robot commands, else 0")
FL_FIELD(fl_real, wrench_offset, [6], "N, N m", "o, wrench beside that of the forces")
FL_FIELD(fl_real, basis, [6][6], "1", "6 x r: directions of scaled wrenches that are driven")
FL_END(fl_head)

FL_BEGIN(fl_actuator)
FL_FIELD(fl_real, rows, , "1",
         "of B: 1: a force along one direction; 2: in a plane, or a lift and its drag")
FL_FIELD(fl_real, force_table, , "offset", "T(v), table of force over price")
FL_FIELD(fl_real, force_table_reverse, , "offset", "the same in reverse")
FL_FIELD(fl_real, force_scale, , "1", "k_T, force over that of the tables")
FL_FIELD(fl_real, power_scale, , "1", "k_P, power over that of the tables")
FL_FIELD(fl_real, gauge_table, , "offset", "radius and support function of a plane by direction")
FL_FIELD(fl_real, force_min, , "N", "least force; of planes below 0 against their direction")
FL_FIELD(fl_real, force_max, , "N", "largest force")
FL_FIELD(fl_real, force_min_needed, , "N", "force_min, but 0 where no reverse is needed")
FL_FIELD(fl_real, sector_center, , "rad", "of the arc of directions")
FL_FIELD(fl_real, sector_half_angle, , "rad", "half of that arc; pi for all directions")
FL_FIELD(fl_real, dead_band, , "N", "forces smaller than this, other than 0, cannot be held")
FL_FIELD(fl_real, flow_speed, , "m/s",
         "U; above 0: the second row is drag, whose power is U times drag")
FL_FIELD(fl_real, secant, [2], "N^2/W", "|y| / |s| of each row at the largest force, by half of it")
FL_FIELD(fl_real, row_force_max, [2], "N", "largest force of each row")
FL_FIELD(fl_real, effectiveness_reduced, [2][6], "1/N",
         "columns of B: scaled wrench in the basis per newton of each row")
FL_FIELD(fl_real, effectiveness_normalized, [3][6], "1/N",
         "B / sigma: wrench over the wrench scale per newton along each axis of the law")
FL_FIELD(fl_real, command_kind, , "1", "how forces become commands: FL_THRUSTER ...")
FL_FIELD(fl_real, command_min, [3], "command", "least command; unused numbers 0")
FL_FIELD(fl_real, command_max, [3], "command", "largest command; unused numbers 0")
FL_FIELD(fl_real, max_change, [3], "command", "largest changes in a tick")
FL_FIELD(fl_real, is_free_angle, , "1", "1 where the angle of the command may turn freely")
FL_FIELD(fl_real, barred_count, , "1", "of a pod: zones between arcs that it may not push in")
FL_FIELD(fl_real, barred, [4][2], "rad", "least and greatest angle of each such zone")
FL_FIELD(fl_real, law_grid, , "offset", "grid of the law")
FL_FIELD(fl_real, command_table, , "offset",
         "a fin's beat, a foil's curve of lift and angle, or the ends of a steered propeller's "
         "curve: angle of the force and deflection")
FL_FIELD(fl_real, command_sign, , "1",
         "of the command over the force: -1 of a thruster that only pulls, else 1")
FL_FIELD(fl_real, lean_angle, , "rad", "of a fin or foil: angle from command to force")
FL_FIELD(fl_real, unevenness, , "1", "of a fin: 1 + unevenness cos(angle - unevenness_angle)")
FL_FIELD(fl_real, unevenness_angle, , "rad", "see unevenness")
FL_FIELD(fl_real, pressure_area, , "N",
         "of a foil: dynamic pressure times area; of a steered propeller: p, the thrust whose "
         "slipstream is as fast as the flow")
FL_FIELD(fl_real, zero_lift_angle, , "rad", "of a foil: angle without lift")
FL_FIELD(fl_real, zero_lift_drag, , "1", "of a foil: coefficient of drag there")
FL_FIELD(fl_real, uncertainty_cost, , "W/N^2",
         "of a foil: what a squared force costs beside its power")
FL_END(fl_actuator)

FL_BEGIN(fl_policy)
FL_FIELD(int, kind, , "1", "FL_CLOSEST ...")
FL_FIELD(int, group_count, , "1", "of axes, for FL_PRIORITY; 1 for FL_FALLING")
FL_FIELD(fl_real, axis_weight, [6], "1", "of the axes, largest 1, for FL_CLOSEST")
FL_FIELD(fl_byte, group, [6][6], "1", "1 of the axes of each group; of those that fall")
FL_END(fl_policy)

FL_BEGIN(fl_budget)
FL_FIELD(int, buses, , "1", "of which the power is limited, 1 to FL_BUSES")
FL_FIELD(fl_real, watts, [FL_BUSES], "W",
         "the most that the actuators of each bus may take together")
FL_FIELD(fl_byte, bus_of, [FL_MOST], "1",
         "which bus feeds each actuator, from 1 on; 0 of one whose power has no limit")
FL_END(fl_budget)

FL_BEGIN(fl_question)
FL_FIELD(fl_real, wrench, [6], "N, N m",
         "desired; behind it all is zeros where there is nothing to say")
FL_FIELD(fl_policy_at, policy, , "address", "what to give beyond reach; 0: nothing else")
FL_FIELD(fl_reals, multipliers, , "address",
         "lambda (6,) of the wrench [W/N, W/(N m)] to begin with, of many (count, 6); 0 for none")
FL_FIELD(fl_reals, previous, , "address",
         "commands (n, 3) of the tick before, NaN for an unknown one; 0 for none")
FL_FIELD(fl_bytes, lost, , "address", "(n,) which actuators do not work; 0 for none")
FL_FIELD(fl_bytes, free, , "address",
         "(6,) which axes may take any wrench, beside those not commanded; 0 for none")
FL_FIELD(fl_real, calm, , "1",
         "what turning costs in a tick: 0 nothing, 2 usual; users may set up to 10, turning ahead "
         "makes that up to 100, and 1000 is the most that is answered")
FL_FIELD(int, ticks, , "1",
         "how many ticks after `previous` the commands are for; 0 or 1 for the next")
FL_FIELD(fl_reals, angles_wanted, , "address",
         "(n,) [rad] from which turning of pods costs, NaN: that of `previous`; 0 for none")
FL_FIELD(fl_budget_at, budget, , "address", "what buses may take; 0 for no limit")
FL_END(fl_question)

FL_BEGIN(fl_answer)
FL_FIELD(fl_real, force, [FL_MOST][2], "N", "of each actuator's rows")
FL_FIELD(fl_real, multipliers, [6], "W/N, W/(N m)", "lambda of the wrench, Eq. 3")
FL_FIELD(fl_real, lambda_reduced, [6], "W",
         "the same in reduced coordinates, of what actuators span now")
FL_FIELD(fl_real, wrench_served, [6], "N, N m",
         "wrench that the forces give, out of reach by the policy")
FL_FIELD(fl_real, gap_power_bound, , "W", "power that gaps are proved to need")
FL_FIELD(fl_real, error, , "1",
         "distance of the commands' wrench from wrench_served, over the wrench scale, by law grids")
FL_FIELD(fl_real, command, [FL_MOST][3], "command", "of each actuator")
FL_FIELD(int, newton_status, , "1", "how Newton's method ended: FL_MET ...")
FL_FIELD(int, is_attainable, , "1", "1 where the target is within reach")
FL_FIELD(int, newton_steps, , "1", "Newton's steps")
FL_FIELD(int, is_truncated, , "1",
         "1 where a search ended at its bound: all limits hold, but the power may not be least; "
         "most_parts of fl_settings is that bound")
FL_FIELD(int, has_foil_commands, , "1", "1 where the commands are those of a search, for foils")
FL_FIELD(int, exceeds_budget, , "1",
         "1 where a bus takes more than it may, and no better answer was found")
FL_END(fl_answer)

FL_BEGIN(fl_answer_row)
FL_FIELD(fl_real, error, , "1", "as of fl_answer")
FL_FIELD(fl_real, gap_power_bound, , "W", "as of fl_answer")
FL_FIELD(fl_real, is_attainable, , "1", "1 where the target is within reach, else 0")
FL_FIELD(fl_real, is_truncated, , "1", "1 where a search ended at its bound, else 0")
FL_FIELD(fl_real, is_tick, , "1", "1 where the question has commands of the tick before, else 0")
FL_FIELD(fl_real, wrench, [6], "N, N m", "as of fl_question")
FL_FIELD(fl_real, multipliers, [6], "W/N, W/(N m)", "as of fl_answer")
FL_FIELD(fl_real, wrench_served, [6], "N, N m",
         "as of fl_answer; behind it stand commands (n, 3), NaN if lost, forces (n, 2), and in a "
         "tick the commands before (n, 3)")
FL_END(fl_answer_row)

FL_BEGIN(fl_prepared_call)
FL_FIELD(fl_reals, block, , "address", "numbers of the robot")
FL_FIELD(fl_work_at, work, , "address", "its prepared work area")
FL_FIELD(fl_coupled_at, coupled, , "address",
         "what its actuators do to each other; 0 where that is nothing")
FL_FIELD(fl_row_at, block_linear, , "address",
         "numbers of its linear model, which answers change; 0 unless `coupled`")
FL_FIELD(fl_question_at, question, , "address",
         "all that is asked but wrench, commands of the tick before, calm and multipliers")
FL_FIELD(fl_row_at, rows, , "address", "(row_count, row_numbers) of answers")
FL_FIELD(fl_flag_at, is_busy, , "address",
         "1 while another call works with the work area, without the lock of the interpreter")
FL_FIELD(fl_real, most_wrench, , "1", "largest wrench, as a vector of six numbers")
FL_FIELD(fl_real, most_error, , "1", "error up to which commands are exact")
FL_FIELD(fl_real, calm, , "1", "fl_question.calm of a tick")
FL_FIELD(int, row_numbers, , "1", "numbers of a row")
FL_FIELD(int, row_count, , "1", "rows")
FL_FIELD(int, used, , "1", "rows that hold answers")
FL_END(fl_prepared_call)

FL_BEGIN(fl_actuator_conjugate)
FL_FIELD(fl_real, price_ahead, , "W/N",
         "along the force of an actuator, ahead; 0 where it pushes in reverse")
FL_FIELD(fl_real, price_reverse, , "W/N", "along the force in reverse")
FL_FIELD(fl_real, conjugate, , "W", "c*(s), Eq. 4: most that a force is worth, less its power")
FL_FIELD(fl_real, force_min, , "N", "least force, of planes below 0 in reverse")
FL_FIELD(fl_real, force_max, , "N", "largest force")
FL_END(fl_actuator_conjugate)

FL_BEGIN(fl_formula)
FL_FIELD(fl_real, kind, , "1", "of the law: FL_DRAG ...")
FL_FIELD(fl_real, coefficient, , "N s^2, N or W",
         "of a fin's thrust, or power of a propeller at 1 N ahead")
FL_FIELD(fl_real, coefficient_reverse, , "W", "power of a propeller at 1 N in reverse")
FL_FIELD(fl_real, power_exponent, , "1", "of a propeller's power over its force")
FL_FIELD(fl_real, dead_band, , "N", "commanded forces smaller than this give none")
FL_FIELD(fl_real, rise_exponent, , "1", "p of a soft fin")
FL_FIELD(fl_real, fall_begin, , "rad Hz", "x0 of a soft fin")
FL_FIELD(fl_real, fall_exponent, , "1", "q of a soft fin")
FL_FIELD(fl_real, unevenness, , "1", "e of a soft fin")
FL_FIELD(fl_real, unevenness_angle, , "rad", "phi_e of a soft fin")
FL_FIELD(fl_real, lean_angle, , "rad", "of a fin: angle from command to force")
FL_FIELD(fl_real, blade_drag, , "N m s^2", "K of a fin's blade")
FL_FIELD(fl_real, blade_inertia, , "kg m^2", "J of the blade and of the water that it carries")
FL_END(fl_formula)

FL_BEGIN(fl_settings)
FL_FIELD(int, most_parts, , "1",
         "parts of sets with gaps that are looked at for one wrench: bounds its time")
FL_FIELD(int, tick_parts, , "1",
         "the same in a tick where turning costs, as the next tick goes on from there")
FL_FIELD(int, command_steps, , "1",
         "Levenberg-Marquardt steps that end an answer; most end after three")
FL_END(fl_settings)

FL_BEGIN(fl_coupled_robot)
FL_FIELD(fl_offset_at, offset, , "address",
         "function of the wrench offset o of Eq. 18, such as fl_jets")
FL_FIELD(fl_reals, constants, , "address", "what that function works with, such as those of jets")
FL_FIELD(fl_reals, inflow, , "address",
         "(n, 3) velocities of the actuators' positions through the water [m/s]; 0 at rest")
FL_FIELD(fl_reals, block_uncoupled, , "address", "block of the robot by its laws alone")
FL_FIELD(fl_reals, line_jets, , "address",
         "what fl_prepare_line_jets has written; 0 where jets are no others than fl_jets says")
FL_FIELD(fl_reals, frames, , "address",
         "(n, 3, 3) axes of the laws' forces in the body frame, in rows")
FL_FIELD(fl_real, axis_counts, [6], "1", "1 of axes that count, else 0")
FL_FIELD(fl_reals, starts, , "address",
         "(start_count, n, 2) complex factors of the forces by the laws alone: where iterations "
         "begin anew")
FL_FIELD(int, start_count, , "1", "how many of these starts there are")
FL_END(fl_coupled_robot)

FL_BEGIN(fl_messages)
FL_FIELD(fl_reals, rows, , "address", "(m, f + 3 k) f features, and k vectors [N], of m messages")
FL_FIELD(fl_reals, slopes, , "address",
         "(m, d, f + 3 k) their derivatives by d numbers of the forces; 0 for none")
FL_FIELD(fl_reals, factors, , "address", "(m, k) of the vectors, by a model of interaction")
FL_FIELD(fl_reals, jacobians, , "address",
         "(m, k, f) derivatives of the factors by the features; 0 for none")
FL_END(fl_messages)

FL_BEGIN(fl_outer_limits)
FL_FIELD(fl_real, penalty_least, , "W",
         "what an error as large as the wrench scale counts at least")
FL_FIELD(fl_real, most_steps, , "1",
         "steps after which no iteration but the first is begun, infinity for no limit")
FL_FIELD(int, most_iterations, , "1",
         "outer iterations at most; 0 for commands of the nearest forces that give the wrench")
FL_END(fl_outer_limits)

FL_BEGIN(fl_outer_result)
FL_FIELD(fl_real, power, , "W", "of the forces that the iterations come to")
FL_FIELD(fl_real, penalty, , "W", "what an error as large as the wrench scale counted last")
FL_FIELD(fl_real, error, , "1",
         "distance of the wrench from the one desired, over the wrench scale")
FL_FIELD(fl_real, steps, , "1", "steps of Newton's method and on commands")
FL_END(fl_outer_result)
