/* A fuzzer of the core: blocks with mutated numbers, wild wrenches, policies, multipliers and previous commands. What is
   not refused by an error code must come back finite, within the limits to the bit, in a bounded number of steps.
   Built with the C files of an export; arguments: cases, seed. */
#include "robot.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t state;
static double uniform(void) { /* xorshift64* */
  state ^= state >> 12, state ^= state << 25, state ^= state >> 27;
  return (double)((state * 2685821657736338717u) >> 11) / 9007199254740992.0;
}
static int below(int n) { return (int)(uniform() * n); }

static fl_real wild(fl_real old) {
  static const double special[] = {0, -1, 1, 2, 0.5, NAN, INFINITY, -INFINITY, 1e30, -1e30, 1e-30, 65536, 1e9, 3.14159265358979};
  switch (below(6)) {
  case 0: return (fl_real)special[below((int)(sizeof special / sizeof *special))];
  case 1: return -old;
  case 2: return (fl_real)((double)old * exp(20 * (uniform() - 0.5)));
  case 3: return (fl_real)((double)old * (1 + 1e-3 * (uniform() - 0.5)));
  case 4: return old + (fl_real)(below(21) - 10);
  default: return (fl_real)(exp(60 * (uniform() - 0.5)) * (below(2) ? 1 : -1));
  }
}

static void ask(fl_question *q, fl_policy *policy, fl_real *price, fl_real *previous, unsigned char *flags,
                const fl_actuator *actuators) {
  double size = exp(12 * (uniform() - 0.5));
  memset(q, 0, sizeof *q);
  for (int k = 0; k < 6; k++) {
    q->wrench[k] = below(4) ? (fl_real)(size * (2 * uniform() - 1)) : 0;
    if (!below(50)) q->wrench[k] = wild(q->wrench[k]);
    price[k] = (fl_real)(size * (2 * uniform() - 1));
    policy->axis_weight[k] = (fl_real)uniform();
    for (int g = 0; g < 6; g++) policy->group[g][k] = (unsigned char)below(2);
  }
  policy->kind = below(20) ? below(3) : below(100) - 50, policy->group_count = below(20) ? below(7) : below(100) - 50;
  if (!below(30)) policy->axis_weight[below(6)] = wild(1);
  if (!below(30)) price[below(6)] = wild(1);
  for (int k = 0; k < 3 * ROBOT_COUNT; k++) {
    const fl_actuator *a = actuators + k / 3;
    previous[k] = a->command_min[k % 3] + (a->command_max[k % 3] - a->command_min[k % 3]) * (fl_real)uniform();
    if (!below(50)) previous[k] = wild(previous[k]);
  }
  for (int k = 0; k < ROBOT_COUNT + 6; k++) flags[k] = (unsigned char)!below(4);
  q->policy = below(4) ? policy : 0;
  q->multipliers = below(4) ? 0 : price;
  q->previous = below(2) ? previous : 0;
  q->lost = below(3) ? 0 : flags;
  q->free = below(3) ? 0 : flags + ROBOT_COUNT;
  q->ticks = below(20) ? below(10) : below(100) - 50;
  q->calm = below(20) ? (fl_real)below(11) : wild(1);
}

static const char *wrong_with(const fl_answer *out, const fl_actuator *actuators, int count) {
  for (int i = 0; i < count; i++)
    for (int k = 0; k < 3; k++)
      if (!(out->command[i][k] >= actuators[i].command_min[k] && out->command[i][k] <= actuators[i].command_max[k])) return "command";
  for (int k = 0; k < 6; k++)
    if (!isfinite(out->wrench_served[k])) return "aim";
  if (!isfinite(out->error)) return "error";
  return out->newton_steps < 0 || out->newton_steps > FL_BOUND ? "steps" : 0;
}

static int fuzz(int cases, fl_real *block, fl_work *work) {
  int refused = 0, answers = 0, most = 0;
  memcpy(block, robot, (size_t)robot_length * sizeof *block);
  for (int n = 0; n < cases; n++) {
    int changed[4], changes = below(3) ? 1 + below(4) : 0, length = below(50) ? robot_length : below(robot_length + 1);
    for (int c = 0; c < changes; c++) { /* the head and actuators as often as all tables */
      int front = (int)((sizeof(fl_head) + ROBOT_COUNT * sizeof(fl_actuator)) / sizeof(fl_real));
      changed[c] = below(2) ? below(front) : below(robot_length);
      block[changed[c]] = wild(block[changed[c]]);
    }
    int error = fl_check(block, length);
    if (!error && length != robot_length) return printf("case %d: a block cut to %d is taken\n", n, length), 1;
    memset(work, 0xff, sizeof *work);
    if (!error) error = fl_prepare(block, work);
    if (!changes && length == robot_length && error) return printf("the block itself is refused: %d\n", error), 1;
    refused += error != 0;
    const fl_actuator *actuators = (const fl_actuator *)(block + sizeof(fl_head) / sizeof(fl_real));
    for (int k = 0; !error && k < 3; k++) {
      fl_question q;
      fl_policy policy;
      fl_answer out;
      fl_real price[6], previous[3 * ROBOT_COUNT];
      unsigned char flags[ROBOT_COUNT + 6];
      ask(&q, &policy, price, previous, flags, actuators);
      memset(&out, 0xff, sizeof out);
      int failed = fl_answer_one(block, work, &q, &out);
      const char *wrong = failed ? 0 : wrong_with(&out, actuators, (int)((fl_head *)block)->n);
      int bad = 0;
      for (int j = 0; j < 6; j++) bad |= !isfinite(q.wrench[j]);
      if (bad && !failed) wrong = "a wrench that is no number is answered";
      if (wrong) return printf("case %d, question %d, %d changes: %s\n", n, k, changes, wrong), 1;
      answers += !failed;
      if (!failed && out.newton_steps > most) most = out.newton_steps;
    }
    while (changes--) block[changed[changes]] = robot[changed[changes]];
  }
  printf("%d blocks, %d refused, %d answers, %d steps at most of %d\n", cases, refused, answers, most, FL_BOUND);
  return 0;
}

int main(int argc, char **argv) {
  state = 88172645463325252u + (argc > 2 ? (uint64_t)atoi(argv[2]) : 0);
  fl_real *block = malloc((size_t)robot_length * sizeof *block); /* of this size, so that a sanitizer sees beyond */
  fl_work *work = malloc(sizeof *work);
  int failed = !block || !work ? 2 : fuzz(argc > 1 ? atoi(argv[1]) : 1000, block, work);
  free(block), free(work);
  return failed;
}
