/* What the three numbers of a command are, and what the block has for it: a row for each kind of
   command. Who asks about a kind reads its row; its laws are in command_law.c. */
#include "internal.h"

static const command_form FORMS[FL_KINDS] = {
    [FL_THRUSTER] = {.numbers = 1, .angle_number = NO_NUMBER, .force_number = 0},
    [FL_POD] = {.numbers = 2, .angle_number = 0, .force_number = 1},
    [FL_FIN] = {.numbers = 3,
                .angle_number = 2,
                .force_number = NO_NUMBER,
                .command_table = BEAT_TABLE,
                .has_law_grid = 1},
    /* its angle is a deflection within limits, which never wraps */
    [FL_FOIL] = {.numbers = 1,
                 .angle_number = NO_NUMBER,
                 .force_number = NO_NUMBER,
                 .command_table = CURVE_TABLE,
                 .has_law_grid = 1,
                 .has_drag = 1},
    /* nor does that of a rudder behind a propeller, which pulls along its own axis alone */
    [FL_STEERED] = {.numbers = 2,
                    .angle_number = NO_NUMBER,
                    .force_number = 1,
                    .command_table = ENDS_TABLE,
                    .has_law_grid = 1,
                    .reverses_straight = 1},
};

const command_form *fl_form_of(const fl_actuator *a) { return FORMS + (int)a->command_kind; }

/* Whether a command is a direction and a force along it, below 0 in reverse. */
int fl_aims_force(const fl_actuator *a) {
  const command_form *form = fl_form_of(a);
  return form->angle_number != NO_NUMBER && form->force_number != NO_NUMBER;
}

/* Whether the command of a plane has its force in reverse. */
int fl_is_in_reverse(const fl_actuator *a, const real *command) {
  const int number = fl_form_of(a)->force_number;
  return is_plane(a) && number != NO_NUMBER && command[number] < 0;
}
