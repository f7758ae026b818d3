/* Answers of the core to questions from standard input: of each a policy's number and a wrench, to
   which it prints the numbers of all commands. Built with the C files of an export. */
#include "robot.h"
#include <stdio.h>
#include <string.h>

static fl_work work;
static fl_answer answer;

int main(void) {
  int kind;
  if (fl_check(robot, robot_length) != FL_OK || fl_prepare(robot, &work) != FL_OK) return 1;
  while (scanf("%d", &kind) == 1) {
    fl_policy policy = {0};
    fl_question question = {0};
    policy.kind = kind;
    policy.group_count = 3;
    policy.group[0][2] = 1;
    for (int k = 3; k < 6; k++) policy.group[1][k] = 1;
    policy.group[2][0] = 1;
    policy.group[2][1] = 1;
    for (int k = 0; k < 6; k++) {
      double number;
      if (scanf("%lf", &number) != 1) return 1;
      policy.axis_weight[k] = 1;
      question.wrench[k] = (fl_real)number;
    }
    question.policy = &policy;
    if (fl_answer_one(robot, &work, &question, &answer) != FL_OK) return 1;
    for (int i = 0; i < (int)ROBOT_HEAD->n; i++) {
      for (int k = 0; k < 3; k++) printf("%.17g ", (double)answer.command[i][k]);
    }
    printf("\n");
  }
  return 0;
}
