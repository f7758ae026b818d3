/* What a question may say, and what it may not: errors, ticks, losses, free axes, settings. */
#include "golden.h"
#include "golden_pods.h"
#include "golden_thrusters.h"

static fl_work work;
static fl_answer answer;

static int ask(const golden_robot *robot, const fl_question *question) {
  return fl_answer_one(robot->block, &work, question, &answer);
}

static fl_question question_of(const golden_robot *robot, int k) {
  fl_question question = {0};
  memcpy(question.wrench, robot->questions[k].within, sizeof question.wrench);
  return question;
}

static void test_errors_have_sentences(void) {
  for (int code = FL_OK; code < FL_ERRORS; code++) {
    CHECK(strlen(fl_error_text(code)) >= strlen("all is well"), "code", code);
    for (int other = FL_OK; other < code; other++) {
      CHECK(strcmp(fl_error_text(code), fl_error_text(other)) != 0, "code", code);
    }
  }
  CHECK(strcmp(fl_error_text(FL_ERRORS), fl_error_text(1000)) == 0, "code", FL_ERRORS);
}

static void test_damaged_blocks_are_refused(const golden_robot *robot) {
  static fl_real block[100000];
  memcpy(block, robot->block, (size_t)robot->length * sizeof *block);
  fl_head *head = (fl_head *)(void *)block;
  CHECK(fl_check(block, robot->length) == FL_OK, robot->name, 0);
  CHECK(fl_check(block, robot->length - 1) == FL_BAD_BLOCK, robot->name, 0);
  head->version += 1;
  CHECK(fl_check(block, robot->length) == FL_BAD_VERSION, robot->name, 0);
  head->version -= 1;
  head->wrench_scale[3] = (fl_real)NAN;
  CHECK(fl_check(block, robot->length) == FL_BAD_NUMBER, robot->name, 0);
}

static void test_numbers_that_are_none_are_refused(const golden_robot *robot) {
  const fl_real broken[] = {(fl_real)NAN, (fl_real)INFINITY, (fl_real)-INFINITY};
  for (int k = 0; k < 3; k++) {
    for (int axis = 0; axis < 6; axis++) {
      fl_question question = question_of(robot, 0);
      question.wrench[axis] = broken[k];
      CHECK(ask(robot, &question) == FL_BAD_ARGUMENT, robot->name, axis);
    }
  }
  fl_question question = question_of(robot, 0);
  question.calm = -1;
  CHECK(ask(robot, &question) == FL_BAD_ARGUMENT, robot->name, 0);
  const fl_policy unknown = {99, 0, {1, 1, 1, 1, 1, 1}, {{0}}};
  question = question_of(robot, 0);
  question.policy = &unknown;
  CHECK(ask(robot, &question) == FL_BAD_ARGUMENT, robot->name, 0);
  question = question_of(robot, 0); /* and the work area is as good as before */
  CHECK(ask(robot, &question) == FL_OK && answer.is_attainable, robot->name, 0);
}

static void check_limits(const golden_robot *robot, int k) {
  const fl_actuator *a = actuators_of(robot->block);
  for (int i = 0; i < (int)head_of(robot->block)->n; i++) {
    for (int c = 0; c < 3; c++) {
      CHECK(answer.command[i][c] >= a[i].command_min[c], robot->name, k);
      CHECK(answer.command[i][c] <= a[i].command_max[c], robot->name, k);
    }
  }
}

/* By how much a number of a command may change in a tick, and a little for rounding. */
static void check_rates(const golden_robot *robot, fl_real previous[][3], int k) {
  const fl_actuator *a = actuators_of(robot->block);
  for (int i = 0; i < (int)head_of(robot->block)->n; i++) {
    for (int c = 0; c < 3; c++) {
      double change = (double)answer.command[i][c] - (double)previous[i][c];
      const int is_free_angle = a[i].command_kind == FL_POD && c == 0 && a[i].is_free_angle != 0;
      if (is_free_angle) change = remainder(change, 2 * acos(-1.0));
      CHECK(fabs(change) <= (double)a[i].max_change[c] * (1 + 1e-5) + 1e-6, robot->name, k);
    }
  }
}

static void test_limits_and_rates_hold(const golden_robot *robot) {
  const fl_policy closest = {FL_CLOSEST, 0, {1, 1, 1, 1, 1, 1}, {{0}}};
  fl_real previous[FL_MOST][3];
  fl_question question = question_of(robot, 0);
  CHECK(ask(robot, &question) == FL_OK, robot->name, 0);
  int moved = 0;
  for (int tick = 0; tick < 20; tick++) {
    const golden_question *golden = &robot->questions[tick % robot->count];
    memcpy(previous, answer.command, sizeof previous);
    question = question_of(robot, 0);
    if (tick % 2)
      memcpy(question.wrench, golden->beyond, sizeof question.wrench);
    else
      memcpy(question.wrench, golden->within, sizeof question.wrench);
    question.policy = &closest;
    question.previous = previous[0];
    question.calm = 2;
    CHECK(ask(robot, &question) == FL_OK, robot->name, tick);
    check_limits(robot, tick);
    check_rates(robot, previous, tick);
    moved += memcmp(previous, answer.command, sizeof previous[0]) != 0;
  }
  CHECK(moved > 10, robot->name, moved);
}

static void test_lost_actuators_give_nothing(const golden_robot *robot) {
  const fl_policy closest = {FL_CLOSEST, 0, {1, 1, 1, 1, 1, 1}, {{0}}};
  for (int i = 0; i < (int)head_of(robot->block)->n; i++) {
    fl_byte lost[FL_MOST] = {0};
    lost[i] = 1;
    fl_question question = question_of(robot, 0);
    question.policy = &closest;
    question.lost = lost;
    CHECK(ask(robot, &question) == FL_OK, robot->name, i);
    CHECK(answer.force[i][0] == 0 && answer.force[i][1] == 0, robot->name, i);
    CHECK((double)answer.error <= 10 * met, robot->name, i);
  }
}

/* A wrench that costs less may be given in free axes; its other axes are given as before. */
static void test_free_axes_cost_no_more(const golden_robot *robot) {
  for (int k = 0; k < robot->count; k++) {
    const fl_byte free[6] = {0, 0, 0, 1, 1, 1};
    fl_real force[FL_MOST][2];
    fl_question question = question_of(robot, k);
    question.free = free;
    CHECK(ask(robot, &question) == FL_OK && answer.is_attainable, robot->name, k);
    CHECK((double)answer.error <= met, robot->name, k);
    const double bound =
        (double)fl_dual_value(robot->block, &work, question.wrench, answer.lambda_reduced, *force);
    CHECK(bound <= robot->questions[k].power * (1 + optimal), robot->name, k);
  }
}

static void test_settings_bound_the_search(const golden_robot *robot) {
  fl_settings settings;
  fl_usual_settings(&settings);
  CHECK(settings.most_parts > 0 && settings.command_steps > 0, robot->name, 0);
  const fl_settings usual = settings;
  settings.command_steps = -1;
  CHECK(fl_use_settings(&work, &settings) == FL_BAD_ARGUMENT, robot->name, 0);

  /* Without steps on commands what is left is what the thin tables are off. */
  settings = usual;
  settings.command_steps = 0;
  CHECK(fl_use_settings(&work, &settings) == FL_OK, robot->name, 0);
  fl_question question = question_of(robot, 0);
  CHECK(ask(robot, &question) == FL_OK, robot->name, 0);
  const double error_without = (double)answer.error;
  CHECK(fl_use_settings(&work, &usual) == FL_OK, robot->name, 0);
  CHECK(ask(robot, &question) == FL_OK, robot->name, 0);
  CHECK((double)answer.error <= error_without, robot->name, 0);
  CHECK(error_without < 0.1, robot->name, 0);
}

int main(void) {
  const golden_robot *robots[] = {&thrusters, &pods};
  test_errors_have_sentences();
  for (int r = 0; r < (int)(sizeof robots / sizeof *robots); r++) {
    const golden_robot *robot = robots[r];
    CHECK(fl_prepare(robot->block, &work) == FL_OK, robot->name, 0);
    test_damaged_blocks_are_refused(robot);
    test_numbers_that_are_none_are_refused(robot);
    test_limits_and_rates_hold(robot);
    test_lost_actuators_give_nothing(robot);
    test_free_axes_cost_no_more(robot);
    test_settings_bound_the_search(robot);
  }
  printf("%d failures\n", failures);
  return failures != 0;
}
