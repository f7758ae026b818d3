/* What is given where actuators act on each other, and the wrench that is asked for is beyond
   reach of the whole model: the one that the linear model serves in its place, by steps on the
   commands, and on a ray the largest share that such steps come to (Eq. 14). */
#include "internal.h"

#define SERVED_STEPS 30 /* steps on commands to a wrench */
#define TICK_STEPS 120  /* the same to a wrench that rates hold back */
/* Error over the wrench scale up to which commands of a tick may yet meet the wrench, though the
   linear model says that it is beyond reach. */
#define CLOSE_IN_TICK R(0.02)
#define RAY_ROUNDS 12 /* shares of a ray that are tried */

/* Finds the largest share of a wrench that steps on commands come to, by bisection, and makes the
   commands those that give it. */
static void go_along_ray(const fl_coupled_robot *robot, real *block, fl_work *work,
                         const fl_box *box, const real *wrench, fl_answer *answer) {
  const size_t size = (size_t)COUNT(block) * sizeof answer->command[0];
  const real *sigma = HEAD(block)->wrench_scale;
  real given[6];
  real along = 0;
  real length_squared = TINY;
  fl_coupled_wrench(robot, block, work, answer->command, given);
  for (int k = 0; k < 6; k++) {
    const real ray = wrench[k] / sigma[k];
    along += given[k] / sigma[k] * ray;
    length_squared += ray * ray;
  }
  real low = 0;
  real high = clipped(along / length_squared * (1 + CLOSE), 0, 1);
  real tried = high;
  answer->error = LARGEST_NUMBER;
  for (int k = 0; k < RAY_ROUNDS; k++) {
    real command[FL_MOST][3];
    real target[6];
    memcpy(command, answer->command, size);
    for (int c = 0; c < 6; c++) target[c] = tried * wrench[c];
    const real error =
        fl_refine_coupled(robot, block, work, box, target, NEARLY / 10, SERVED_STEPS, command);
    if (error <= NEARLY) {
      low = tried;
      answer->error = error;
      memcpy(answer->command, command, size);
    } else {
      high = tried;
    }
    if (high - low <= CLOSE * high) break;
    tried = (low + high) / 2;
  }
  for (int c = 0; c < 6; c++) answer->wrench_served[c] = low * wrench[c];
}

void fl_serve_coupled(const fl_coupled_robot *robot, real *block, fl_work *work,
                      const fl_question *q, fl_answer *answer, const fl_outer_result *result) {
  real wrench[6]; /* that is asked for, in axes that count */
  for (int k = 0; k < 6; k++) {
    wrench[k] = 0;
    if (work->span.axis_counts[k]) wrench[k] = q->wrench[k];
  }
  answer->error = result->error;
  if (result->error <= NEARLY) {
    answer->is_attainable = 1;
    memcpy(answer->wrench_served, wrench, sizeof wrench);
    return;
  }
  fl_box box;
  fl_box_of_question(block, work, q, &box);
  /* In a tick the last iteration may have stopped short of it, or of a reach that the linear model
     does not have. */
  const int may_be_met = answer->is_attainable || result->error <= CLOSE_IN_TICK;
  if (q->previous && may_be_met) {
    real command[FL_MOST][3];
    copy_commands(block, answer->command, command);
    const real error =
        fl_refine_coupled(robot, block, work, &box, wrench, EXACT, TICK_STEPS, command);
    fl_clip_commands(block, &box, command);
    if (answer->is_attainable || error <= NEARLY) {
      copy_commands(block, command, answer->command);
      memcpy(answer->wrench_served, wrench, sizeof wrench);
      answer->is_attainable = 1;
      answer->error = error;
      return;
    }
  }
  if (answer->is_attainable) return; /* by the linear model */
  answer->error = fl_refine_coupled(robot, block, work, &box, answer->wrench_served, EXACT,
                                    SERVED_STEPS, answer->command);
  if (q->policy && q->policy->kind == FL_DIRECTION) {
    go_along_ray(robot, block, work, &box, wrench, answer);
  }
  fl_rest_in_dead_bands(block, &box, answer->command);
  fl_clip_commands(block, &box, answer->command);
}
