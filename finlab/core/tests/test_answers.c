/* Answers of golden robots against oracles that have no part of the core. */
#include "golden.h"
#include "golden_arcs.h"
#include "golden_fins.h"
#include "golden_pods.h"
#include "golden_thrusters.h"

/* The oracle of the least miss has polygons in place of circles. */
static const double by_polygons = 1e-4;

static fl_work work;

/* The wrench of commands by the effectiveness of the layout file; returns 0 for fins, whose law
   is a table. */
static int wrench_of(const golden_robot *robot, const fl_answer *answer, fl_real *wrench) {
  const fl_actuator *actuators = actuators_of(robot->block);
  const fl_real(*column)[6] = robot->effectiveness;
  memset(wrench, 0, 6 * sizeof *wrench);
  for (int i = 0; i < (int)head_of(robot->block)->n; i++) {
    const fl_real *command = answer->command[i];
    fl_real force[2] = {command[0], 0};
    int directions = 1;
    if (actuators[i].command_kind == FL_FIN) return 0;
    if (actuators[i].command_kind == FL_POD) {
      force[0] = command[1] * (fl_real)cos((double)command[0]);
      force[1] = command[1] * (fl_real)sin((double)command[0]);
      directions = 2;
    }
    for (int q = 0; q < directions; q++) {
      for (int k = 0; k < 6; k++) wrench[k] += force[q] * (*column)[k];
      column++;
    }
  }
  return 1;
}

static void test_within_reach(const golden_robot *robot, int k) {
  const golden_question *golden = &robot->questions[k];
  fl_question question = {0};
  fl_answer answer;
  memcpy(question.wrench, golden->within, sizeof question.wrench);
  CHECK(fl_answer_one(robot->block, &work, &question, &answer) == FL_OK, robot->name, k);
  CHECK(answer.is_attainable, robot->name, k);
  CHECK((double)answer.error <= met, robot->name, k);

  fl_real wrench[6];
  if (wrench_of(robot, &answer, wrench)) {
    CHECK(distance(robot->block, wrench, golden->within) <= met, robot->name, k);
  }
  /* The dual value proves a bound of the power, and the parts of sets with gaps a higher one. */
  fl_real force[FL_MOST][2];
  const double dual_value =
      (double)fl_dual_value(robot->block, &work, golden->within, answer.lambda_reduced, *force);
  const double bound = fmax(dual_value, (double)answer.gap_power_bound);
  double slack = optimal_with_gaps * golden->power;
  if (robot->has_no_gaps) slack = optimal * golden->power;
  CHECK(fabs(bound - golden->power) <= slack, robot->name, k);
}

static void ask_beyond(const golden_robot *robot, int k, int kind, fl_answer *answer) {
  const fl_policy policy = {kind, 1, {1, 1, 1, 1, 1, 1}, {{1, 1, 1, 1, 1, 1}}};
  fl_question question = {0};
  memcpy(question.wrench, robot->questions[k].beyond, sizeof question.wrench);
  question.policy = &policy;
  CHECK(fl_answer_one(robot->block, &work, &question, answer) == FL_OK, robot->name, k);
  CHECK(!answer->is_attainable, robot->name, k);
  CHECK((double)answer->error <= 10 * met, robot->name, k);
}

static void test_direction(const golden_robot *robot, int k) {
  const golden_question *golden = &robot->questions[k];
  fl_answer answer;
  ask_beyond(robot, k, FL_DIRECTION, &answer);
  double along = 0;
  double squared = 0;
  fl_real on_ray[6];
  for (int c = 0; c < 6; c++) {
    along += (double)answer.wrench_served[c] * (double)golden->beyond[c];
    squared += (double)golden->beyond[c] * (double)golden->beyond[c];
  }
  const double share = along / squared;
  for (int c = 0; c < 6; c++) on_ray[c] = (fl_real)share * golden->beyond[c];
  CHECK(fabs(share - golden->ray_share) <= optimal * golden->ray_share, robot->name, k);
  CHECK(distance(robot->block, on_ray, answer.wrench_served) <= 10 * met, robot->name, k);
}

static void test_closest(const golden_robot *robot, int k) {
  const golden_question *golden = &robot->questions[k];
  fl_answer answer;
  ask_beyond(robot, k, FL_CLOSEST, &answer);
  const double miss = distance(robot->block, answer.wrench_served, golden->beyond);
  CHECK(fabs(miss - golden->miss) <= optimal * golden->miss + by_polygons, robot->name, k);
}

/* Length of a miss in some axes, over the wrench scale. */
static double miss_in(const fl_real *block, const fl_real *a, const fl_real *b, int first) {
  double squared = 0;
  for (int k = first; k < first + 3; k++) {
    const double apart = ((double)a[k] - (double)b[k]) / (double)head_of(block)->wrench_scale[k];
    squared += apart * apart;
  }
  return sqrt(squared);
}

/* The first group misses no more than in any other answer, and what it gets costs the second. */
static void test_groups(const golden_robot *robot, int k) {
  const fl_policy policy = {
      FL_PRIORITY, 2, {1, 1, 1, 1, 1, 1}, {{1, 1, 1, 0, 0, 0}, {0, 0, 0, 1, 1, 1}}};
  const fl_real *beyond = robot->questions[k].beyond;
  fl_answer closest;
  fl_answer forces_first;
  ask_beyond(robot, k, FL_CLOSEST, &closest);
  fl_question question = {0};
  memcpy(question.wrench, beyond, sizeof question.wrench);
  question.policy = &policy;
  CHECK(fl_answer_one(robot->block, &work, &question, &forces_first) == FL_OK, robot->name, k);
  const double first = miss_in(robot->block, forces_first.wrench_served, beyond, 0);
  const double first_closest = miss_in(robot->block, closest.wrench_served, beyond, 0);
  const double second = miss_in(robot->block, forces_first.wrench_served, beyond, 3);
  const double second_closest = miss_in(robot->block, closest.wrench_served, beyond, 3);
  CHECK(first <= first_closest + by_polygons, robot->name, k);
  CHECK(second >= second_closest - by_polygons, robot->name, k);
}

/* No axis is given more than was asked for, nor anything the other way, and no answer that does so
   is nearer than the closest one. */
static void test_falling(const golden_robot *robot, int k) {
  const double nearly = 1e-6; /* up to which an axis is not beyond its range */
  const golden_question *golden = &robot->questions[k];
  fl_answer answer;
  ask_beyond(robot, k, FL_FALLING, &answer);
  const double miss = distance(robot->block, answer.wrench_served, golden->beyond);
  CHECK(miss >= golden->miss - optimal * golden->miss - by_polygons, robot->name, k);
  for (int c = 0; c < 6; c++) {
    const double asked = (double)golden->beyond[c] / (double)head_of(robot->block)->wrench_scale[c];
    const double given = (double)answer.wrench_served[c] /
                         (double)head_of(robot->block)->wrench_scale[c];
    const double sign = asked < 0 ? -1 : 1;
    CHECK(sign * given >= -nearly - 10 * met, robot->name, k);
    CHECK(sign * (given - asked) <= nearly + 10 * met, robot->name, k);
  }
}

/* One group of all axes is the same question as the closest wrench. */
static void test_priority(const golden_robot *robot, int k) {
  const golden_question *golden = &robot->questions[k];
  fl_answer answer;
  ask_beyond(robot, k, FL_PRIORITY, &answer);
  const double miss = distance(robot->block, answer.wrench_served, golden->beyond);
  CHECK(fabs(miss - golden->miss) <= optimal * golden->miss + by_polygons, robot->name, k);
}

int main(void) {
  const golden_robot *robots[] = {&thrusters, &pods, &fins, &arcs};
  for (int r = 0; r < (int)(sizeof robots / sizeof *robots); r++) {
    const golden_robot *robot = robots[r];
    CHECK(fl_check(robot->block, robot->length) == FL_OK, robot->name, 0);
    CHECK(fl_prepare(robot->block, &work) == FL_OK, robot->name, 0);
    for (int k = 0; k < robot->count; k++) {
      test_within_reach(robot, k);
      test_direction(robot, k);
      test_closest(robot, k);
      test_priority(robot, k);
      test_falling(robot, k);
      test_groups(robot, k);
    }
  }
  printf("%d failures\n", failures);
  return failures != 0;
}
