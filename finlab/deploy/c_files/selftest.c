/* Asks what the library was asked at the export and compares the answers; `robot_selftest` says how many differ.
   On a board call it from your own program, as examples/blink.ino does; define FL_NO_MAIN there. */
#include "robot.h"
#include "internal.h"
#include <stdio.h>

typedef struct { /* question and answer of the library: wrench that it gives, its error on the yardstick, commands */
  int policy;
  fl_real wrench[6], aim[6], error, command[ROBOT_COUNT][3];
  const fl_real (*previous)[3];
} sample;
#include "samples.h"

#ifdef FL_SINGLE
#define APART 1e-4
#else
#define APART 1e-5
#endif
#define GROUPS 3
static const unsigned char group[6][6] = {{0, 0, 1}, {0, 0, 0, 1, 1, 1}, {1, 1}}, all[6] = {1, 1, 1, 1, 1, 1};

static fl_work work;
static fl_answer out;
static int most_steps, others;

static double apart(const fl_real *a, const fl_real *b, const unsigned char *axes) {
  double sum = 0;
  for (int k = 0; k < 6; k++) {
    if (!axes[k]) continue;
    double way = ((double)a[k] - (double)b[k]) / (double)((const fl_head *)robot)->wrench_scale[k];
    sum += way * way;
  }
  return sqrt(sum);
}

static int outside(void) {
  for (int i = 0; i < ROBOT_COUNT; i++)
    for (int k = 0; k < 3; k++)
      if (!(out.command[i][k] >= ROBOT_ACTUATOR(i)->command_min[k] && out.command[i][k] <= ROBOT_ACTUATOR(i)->command_max[k])) return 1;
  return 0;
}

/* Whether a command is another one: where several cost the same, the choice is rounding's, as of what hardly pushes. */
static int is_other(const sample *s) {
  for (int i = 0; i < ROBOT_COUNT; i++) {
    const fl_actuator *a = ROBOT_ACTUATOR(i);
    if (size_of(out.force[i]) <= a->row_force_max[0] / 100) continue;
    for (int k = 0; k < 3; k++) {
      fl_real way = out.command[i][k] - s->command[i][k], width = a->command_max[k] - a->command_min[k];
      if (a->is_free_angle != 0 && width > 6) way = fl_wrap_angle(way);
      if (FABS(way) > width / 20) return 1;
    }
  }
  return 0;
}

/* How much farther a wrench is than the library's: `direction` gives one point, the others distances. A tenth counts
   of `direction` where foils drag, whose share is the last one that a search meets. */
static double farther(const sample *s) {
  double most = 0;
  if (s->policy == FL_DIRECTION) return apart(out.wrench_served, s->aim, all) / (work.has_drag ? 10 : 1);
  if (s->policy == FL_CLOSEST) return apart(out.wrench_served, s->wrench, all) - apart(s->aim, s->wrench, all);
  for (int g = 0; g < GROUPS; g++)
    most = fmax(most, apart(out.wrench_served, s->wrench, group[g]) - apart(s->aim, s->wrench, group[g]));
  return most;
}

/* Whether an answer is as near as the library's; commands of a tick, on which the library spends more steps, may be a
   little farther. */
static int differs(const sample *s) {
  fl_policy policy = {s->policy, GROUPS, {1, 1, 1, 1, 1, 1}, {{0}}};
  fl_question question = {.policy = &policy, .calm = CALM};
  if (s->previous) question.previous = s->previous[0];
  memcpy(policy.group, group, sizeof group);
  memcpy(question.wrench, s->wrench, sizeof question.wrench);
  if (fl_answer_one(robot, &work, &question, &out) || outside()) return 1;
  if (out.newton_steps > most_steps) most_steps = out.newton_steps;
  static const fl_real rest[6];
  double size = fmax(1, apart(s->wrench, rest, all)), most = s->previous ? 1e-3 + 1.02 * (double)s->error : 0;
  fl_real command[ROBOT_COUNT][3]; /* the library's, by the laws of this block */
  memcpy(command, s->command, sizeof command);
  if (!(fl_refine_commands(robot, &work, &work.box, s->previous ? s->wrench : s->aim, command, 0) <= s->error + size * APART)) return 1;
  others += is_other(s);
  return !(farther(s) <= size * APART && (double)out.error <= size * APART + most);
}

int robot_selftest(void) {
  fl_question broken = {.wrench = {NAN}};
  int wrong = others = 0;
  if (fl_check(robot, robot_length) || fl_prepare(robot, &work)) return SAMPLES;
  for (int k = 0; k < SAMPLES; k++) wrong += differs(samples + k);
  if (8 * others > SAMPLES) wrong += others;
  return wrong + (fl_answer_one(robot, &work, &broken, &out) != FL_BAD_ARGUMENT);
}

#if !defined(ARDUINO) && !defined(FL_NO_MAIN)
int main(void) {
  int wrong = robot_selftest();
  printf("%d of %d answers differ from the library's; bytes: block %d, work %d, answer %d; Newton's steps: %d at most\n",
         wrong, SAMPLES, robot_length * (int)sizeof *robot, (int)sizeof work, (int)sizeof out, most_steps);
  return wrong != 0;
}
#endif
