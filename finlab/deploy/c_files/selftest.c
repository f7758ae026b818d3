/* Asks what the library was asked at the export and compares the answers; `robot_selftest` says how
   many differ. On a board call it from your own program, as examples/blink.ino does; define
   FL_NO_MAIN there. */
#include "robot.h"
#include "internal.h"
#include <stdio.h>

/* A question, and the library's answer. */
typedef struct {
  int policy;
  fl_real wrench[6];
  fl_real aim[6]; /* wrench that the library's commands give [N, N m] */
  fl_real error;  /* of these commands, over the wrench scale */
  fl_real command[ROBOT_COUNT][3];
  const fl_real (*previous)[3]; /* commands of the tick before, 0 for none */
} sample;
#include "samples.h"

#ifdef FL_SINGLE
#define APART 1e-4 /* share of a wrench by which answers may differ */
#else
#define APART 1e-5
#endif
#define OTHER_COMMAND 20 /* a command off by more than 1/20 of its range is another one */
#define OTHER_SAMPLES 8  /* of so many samples, one may have another command that costs the same */
#define WEAK_FORCE 100 /* up to 1/100 of the largest force, an actuator's command matters little */
#define DRAG_SLACK 10  /* where foils drag, a share of the ray may be off by so many times APART */
/* Where rudders stand in slipstreams, groups after the first may be off by so many times APART in
   single precision: along a curved rim they gain the root of what rounding, a millionth, takes from
   the groups before. The root of TOLERANCE, 1e-6, is 1e-3. */
#if defined(FL_SINGLE) && FL_SLIPSTREAMS
#define LATER_SLACK 10
#else
#define LATER_SLACK 1
#endif
#define FULL_TURN 6      /* an angle whose range is wider wraps; just below 2 pi [rad] */
#define TICK_SLACK 1e-3  /* error, over the wrench scale, that commands of a tick may have ... */
#define TICK_FACTOR 1.02 /* ... beyond so many times the library's */
#define GROUPS 3
static const unsigned char group[6][6] = {{0, 0, 1}, {0, 0, 0, 1, 1, 1}, {1, 1}};
static const unsigned char all[6] = {1, 1, 1, 1, 1, 1};

static fl_work work;
static fl_answer out;
static int most_steps;
static int others; /* samples with another command */

/* The distance of two wrenches, over the wrench scale, in some axes. */
static double apart(const fl_real *a, const fl_real *b, const unsigned char *axes) {
  const fl_head *head = (const fl_head *)robot;
  double sum = 0;
  for (int k = 0; k < 6; k++) {
    if (!axes[k]) continue;
    const double difference = ((double)a[k] - (double)b[k]) / (double)head->wrench_scale[k];
    sum += difference * difference;
  }
  return sqrt(sum);
}

/* Whether a command is outside of its limits, or no number. */
static int outside(void) {
  for (int i = 0; i < ROBOT_COUNT; i++) {
    const fl_actuator *a = ROBOT_ACTUATOR(i);
    const fl_real *command = out.command[i];
    for (int k = 0; k < 3; k++) {
      if (!(command[k] >= a->command_min[k] && command[k] <= a->command_max[k])) return 1;
    }
  }
  return 0;
}

/* Whether a command is another one: where several cost the same, the choice is rounding's, as of
   what hardly pushes. */
static int is_other(const sample *s) {
  for (int i = 0; i < ROBOT_COUNT; i++) {
    const fl_actuator *a = ROBOT_ACTUATOR(i);
    if (size_of(out.force[i]) <= a->row_force_max[0] / WEAK_FORCE) continue;
    for (int k = 0; k < 3; k++) {
      const fl_real range = a->command_max[k] - a->command_min[k];
      fl_real difference = out.command[i][k] - s->command[i][k];
      if (a->is_free_angle != 0 && range > FULL_TURN) difference = fl_wrap_angle(difference);
      if (FABS(difference) > range / OTHER_COMMAND) return 1;
    }
  }
  return 0;
}

/* How much farther a wrench is than the library's, or how far it goes beyond what was asked for
   along an axis. */
static double falls_short(const sample *s) {
  const fl_head *head = (const fl_head *)robot;
  double most = apart(out.wrench_served, s->wrench, all) - apart(s->aim, s->wrench, all);
  for (int k = 0; k < 6; k++) {
    const double sign = s->wrench[k] < 0 ? -1 : 1;
    const double beyond = sign * ((double)out.wrench_served[k] - (double)s->wrench[k]);
    most = fmax(most, beyond / (double)head->wrench_scale[k]);
  }
  return most;
}

/* How much farther a wrench is than the library's: `direction` gives one point, the others
   distances. Less counts of `direction` where foils drag, whose share is the last one that a search
   meets. */
static double farther(const sample *s) {
  if (s->policy == FL_DIRECTION) {
    const double distance = apart(out.wrench_served, s->aim, all);
    return work.has_drag ? distance / DRAG_SLACK : distance;
  }
  if (s->policy == FL_CLOSEST) {
    return apart(out.wrench_served, s->wrench, all) - apart(s->aim, s->wrench, all);
  }
  if (s->policy == FL_FALLING) return falls_short(s);
  double most = 0;
  for (int g = 0; g < GROUPS; g++) {
    const double own = apart(out.wrench_served, s->wrench, group[g]);
    const double more = own - apart(s->aim, s->wrench, group[g]);
    most = fmax(most, g > 0 ? more / LATER_SLACK : more);
  }
  return most;
}

/* Distance of the wrench of commands from another one, over the wrench scale. */
static fl_real error_of(const fl_real *wrench, fl_real command[][3]) {
#ifdef ROBOT_IS_COUPLED
  fl_real residual[6];
  return fl_linearize_coupled(&robot_coupled, robot_linear, &work, wrench, command, 1, residual);
#else
  return fl_refine_commands(robot, &work, &work.box, wrench, command, 0);
#endif
}

/* Whether an answer is farther than the library's; commands of a tick, on which the library spends
   more steps, may be a little farther. */
static int differs(const sample *s) {
  fl_policy policy = {s->policy, GROUPS, {1, 1, 1, 1, 1, 1}, {{0}}};
  fl_question question = {.policy = &policy, .calm = CALM, .budget = ROBOT_BUDGET};
  if (s->previous) question.previous = s->previous[0];
  memcpy(policy.group, group, sizeof group);
  if (s->policy == FL_FALLING) {
    policy.group_count = 1;
    memcpy(policy.group[0], all, sizeof all);
  }
  memcpy(question.wrench, s->wrench, sizeof question.wrench);
#ifndef FL_WITH_FALLING
  if (s->policy == FL_FALLING) {
    return robot_answer(&work, &question, &out) != FL_BAD_ARGUMENT;
  }
#endif
  if (robot_answer(&work, &question, &out) || outside()) return 1;
#ifdef ROBOT_IS_COUPLED
  /* Beyond reach `wrench_served` is that of a linear model: what commands give counts. */
  fl_coupled_wrench(&robot_coupled, robot_linear, &work, out.command, out.wrench_served);
  if (!out.is_attainable) out.error = 0;
#endif
  /* In a tick rates go before budgets. */
  if (out.exceeds_budget && !s->previous) return 1;
  if (out.newton_steps > most_steps) most_steps = out.newton_steps;

  static const fl_real rest[6];
  const double slack = fmax(1, apart(s->wrench, rest, all)) * APART;
  const double tick_slack = s->previous ? TICK_SLACK + TICK_FACTOR * (double)s->error : 0;
  /* The library's commands have the library's error by the laws of this block, too. */
  const fl_real *aim = s->previous ? s->wrench : s->aim;
  fl_real command[ROBOT_COUNT][3];
  memcpy(command, s->command, sizeof command);
  const fl_real error = error_of(aim, command);
  if (!((double)error <= (double)s->error + slack)) return 1;
  others += is_other(s);
  return !(farther(s) <= slack && (double)out.error <= slack + tick_slack);
}

int robot_selftest(void) {
  fl_question broken = {.wrench = {NAN}};
  int wrong = 0;
  others = 0;
  if (fl_check(robot, robot_length) || robot_prepare(&work)) return SAMPLES;
  for (int k = 0; k < SAMPLES; k++) wrong += differs(samples + k);
  if (OTHER_SAMPLES * others > SAMPLES) wrong += others;
  return wrong + (robot_answer(&work, &broken, &out) != FL_BAD_ARGUMENT);
}

#if !defined(ARDUINO) && !defined(FL_NO_MAIN)
int main(void) {
  const int wrong = robot_selftest();
  printf("%d of %d answers differ from the library's; ", wrong, SAMPLES);
  printf("bytes: block %d, work %d, answer %d; ", robot_length * (int)sizeof *robot,
         (int)sizeof work, (int)sizeof out);
  printf("Newton's steps: %d at most\n", most_steps);
  return wrong != 0;
}
#endif
