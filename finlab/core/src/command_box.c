/* Commands within their limits: angles that turn freely, dead bands. */
#include "internal.h"

#define AT_EDGE R(0.9) /* of a dead band: forces above this share of it are put at its edge */

/* A number of a command in a box, an angle wrapped first. */
real fl_clip_number(const fl_box *box, int i, int k, int angle, real value) {
  const real low = box->command_min[i][k];
  const real high = box->command_max[i][k];
  const real middle = (low + high) / 2;
  if (k == angle) value = middle + fl_wrap_angle(value - middle);
  return clipped(value, low, high);
}

/* Whether a command lies in the dead band of its actuator, where it gives no force; on its
   edge but for rounding it does not. */
int fl_is_in_dead_band(const fl_actuator *a, const real *command) {
  const int k = fl_form_of(a)->force_number;
  return k != NO_NUMBER && FABS(command[k]) < a->dead_band * (1 - NEARLY);
}

/* The edge of a dead band on the side of a command. */
static real edge_of_band(const fl_actuator *a, real command) {
  if (command < 0) return -a->dead_band;
  return a->dead_band;
}

/* Puts commands that gaps left a little inside their dead band at its edge: forces nearer to
   it than to rest. */
void fl_leave_dead_bands(const real *block, real force[][2], real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (!(a->dead_band > 0)) continue;
    const int k = fl_form_of(a)->force_number;
    if (k == NO_NUMBER || !fl_is_in_dead_band(a, command[i])) continue;
    if (size_of(force[i]) < AT_EDGE * a->dead_band) continue;
    command[i][k] = edge_of_band(a, command[i][k]);
  }
}

/* Has commands inside a dead band rest, where the box allows, and puts those that rounding
   took from the edge there. */
void fl_rest_in_dead_bands(const real *block, const fl_box *box, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (!(a->dead_band > 0)) continue;
    const int k = fl_form_of(a)->force_number;
    if (k == NO_NUMBER || !(FABS(command[i][k]) < a->dead_band)) continue;
    if (!fl_is_in_dead_band(a, command[i]))
      command[i][k] = edge_of_band(a, command[i][k]);
    else if (box->command_min[i][k] <= 0 && box->command_max[i][k] >= 0)
      command[i][k] = 0;
  }
}

/* Whether no number of a command is NaN. */
int fl_is_known_command(const real *command) {
  return command[0] == command[0] && command[1] == command[1] && command[2] == command[2];
}

/* Commands in the box of a tick, their angles within the limits of the actuators: the last
   look at all that leaves. */
void fl_clip_commands(const real *block, const fl_box *box, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const int angle = fl_form_of(a)->angle_number;
    for (int k = 0; k < 3; k++) {
      real value = command[i][k];
      if (!(k == angle && box->is_free_angle[i])) value = fl_clip_number(box, i, k, angle, value);
      if (k == angle) {
        const real middle = (a->command_min[k] + a->command_max[k]) / 2;
        value = fl_leave_zone(a, middle + fl_wrap_angle(value - middle));
      }
      command[i][k] = clipped(value, a->command_min[k], a->command_max[k]);
    }
  }
}
