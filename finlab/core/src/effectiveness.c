/* What the actuators that work span in the axes that count.

   Scaled wrenches are w / scale; their range is spanned by the columns of an orthonormal
   basis Q (6 x r), in which an actuator's effectiveness is the matrix Q' B. An axis that
   does not count has no row in B, so its price is held at 0; an actuator that is lost has no
   column. Python has prepared all of it for a whole robot; any other state follows here, in
   a few microseconds, and is kept until the next question asks for another one. */
#include "internal.h"

/* Length of a column, over that of the longest one, below which nothing is left of the columns: ten
   times their rounding in single precision, where a lost actuator would else leave a direction
   that is rounding. */
#define LEFT_OVER larger(NOTHING, 10 * ROUNDING)
#define DEPENDENT (LEFT_OVER * LEFT_OVER) /* the squared length */

/* A wrench over the wrench scale per newton of a row, as the laws have it: thrusters may be
   commanded against their force. */
static const real *law_axis(const fl_actuator *a, int row) {
  if (is_plane(a)) return a->effectiveness_normalized[1 + row];
  return a->effectiveness_normalized[row];
}

/* Wrench [N, N m] per newton of a row of an actuator, 0 in axes that do not count. */
static void column_of(const real *block, const fl_span *span, int i, int row, real *column) {
  const fl_actuator *a = ACTUATOR(block, i);
  const real *sigma = HEAD(block)->wrench_scale;
  const real *axis = law_axis(a, row);
  real sign = a->command_sign;
  if ((real)row >= a->rows) sign = 0;
  if (span->is_lost[i]) sign = 0;
  for (int k = 0; k < 6; k++) {
    column[k] = 0;
    if (span->axis_counts[k]) column[k] = sign * sigma[k] * axis[k];
  }
}

/* Size of what the robot can push along each axis; 1 where it cannot. */
static void scale_of(const real *block, fl_span *span) {
  real size[6] = {0};
  real most = 0;
  for (int i = 0; i < COUNT(block); i++) {
    for (int row = 0; row < 2; row++) {
      real column[6];
      column_of(block, span, i, row, column);
      for (int k = 0; k < 6; k++) {
        const real largest = column[k] * ACTUATOR(block, i)->row_force_max[row];
        size[k] += largest * largest;
      }
    }
  }
  for (int k = 0; k < 6; k++) most = larger(most, size[k]);
  for (int k = 0; k < 6; k++) {
    span->axis_scale[k] = 1;
    if (size[k] > DEPENDENT * most) span->axis_scale[k] = SQRT(size[k]);
  }
}

/* The orthonormal basis of all columns, by Gram and Schmidt, the longest first. */
static void basis_of(const real *block, fl_span *span) {
  const int n = COUNT(block);
  real left[2 * FL_MOST][6];
  real longest = 0;
  for (int p = 0; p < 2 * n; p++) {
    column_of(block, span, p / 2, p % 2, left[p]);
    for (int k = 0; k < 6; k++)
      left[p][k] *= ACTUATOR(block, p / 2)->row_force_max[p % 2] / span->axis_scale[k];
  }
  memset(span->basis, 0, sizeof span->basis);
  span->rank = 0;
  while (span->rank < 6) {
    int best = 0;
    for (int p = 1; p < 2 * n; p++) {
      if (dot(left[p], left[p], 6) > dot(left[best], left[best], 6)) best = p;
    }
    const real square = dot(left[best], left[best], 6);
    if (span->rank == 0) longest = square;
    if (!(square > DEPENDENT * longest)) return;
    real q[6];
    for (int k = 0; k < 6; k++) {
      q[k] = left[best][k] / SQRT(square);
      span->basis[k][span->rank] = q[k];
    }
    for (int p = 0; p < 2 * n; p++) {
      const real projection = dot(left[p], q, 6);
      for (int k = 0; k < 6; k++) left[p][k] -= projection * q[k];
    }
    span->rank++;
  }
}

static void matrices_of(const real *block, fl_span *span) {
  for (int i = 0; i < COUNT(block); i++) {
    const int rows = (int)ACTUATOR(block, i)->rows;
    memset(span->effectiveness_reduced[i], 0, sizeof span->effectiveness_reduced[i]);
    for (int row = 0; row < rows; row++) {
      real *reduced = span->effectiveness_reduced[i][row];
      real column[6];
      column_of(block, span, i, row, column);
      for (int k = 0; k < 6; k++) {
        const real scaled = column[k] / span->axis_scale[k];
        for (int j = 0; j < 6; j++) reduced[j] += span->basis[k][j] * scaled;
      }
    }
  }
}

/* As Python has prepared it: of a robot all of whose actuators work and all of whose axes count. */
static void take_prepared(const real *block, fl_span *span) {
  const fl_head *h = HEAD(block);
  memcpy(span->axis_scale, h->axis_scale, sizeof span->axis_scale);
  memcpy(span->basis, h->basis, sizeof span->basis);
  for (int i = 0; i < COUNT(block); i++) {
    memcpy(span->effectiveness_reduced[i], ACTUATOR(block, i)->effectiveness_reduced,
           sizeof span->effectiveness_reduced[i]);
  }
  span->rank = (int)h->rank;
}

/* The wrench beside the forces, less that of actuators that are lost: the drag at rest of foils,
   and the -p of steered propellers. Of all others it is 0. */
void fl_offset_wrench(const real *block, fl_span *span) {
  const fl_head *h = HEAD(block);
  for (int k = 0; k < 6; k++) {
    real sum = h->wrench_offset[k];
    for (int i = 0; i < COUNT(block); i++) {
      const fl_actuator *a = ACTUATOR(block, i);
      if (span->is_lost[i])
        sum -= a->pressure_area * a->zero_lift_drag * a->effectiveness_normalized[1][k] *
               h->wrench_scale[k];
    }
    span->wrench_offset[k] = 0;
    if (span->axis_counts[k]) span->wrench_offset[k] = sum;
  }
}

/* What follows from the matrices for Newton's method: the Hessian of quadratic costs, and
   its factor. */
static int prepare_newton(const real *block, fl_work *work) {
  const fl_span *span = &work->span;
  real(*H)[6] = work->hessian_factor;
  memset(work->hessian_factor, 0, sizeof work->hessian_factor);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int row = 0; row < (int)a->rows; row++) {
      fl_add_square(H, span->effectiveness_reduced[i][row], a->secant[row]);
    }
  }
  const real trace = fl_trace(H);
  for (int j = 0; j < 6; j++) {
    for (int k = 0; k <= j; k++) {
      work->metric[j][k] = H[j][k] * (real)span->rank / larger(trace, TINY);
      work->metric[k][j] = work->metric[j][k];
    }
    work->metric[j][j] += NEARLY;
  }
  for (int j = 0; j < 6; j++) H[j][j] += NOTHING * trace;
  work->trace_min = NEARLY * trace;
  return span->rank == 0 || fl_factor(H);
}

/* Brings the effectiveness, which has changed, into the basis as it is. */
void fl_reduce_effectiveness(const real *block, fl_work *work) { matrices_of(block, &work->span); }

/* Prepares the state of a robot anew; 0 where its numbers are out of range. */
int fl_prepare_span(const real *block, fl_work *work, int is_as_prepared) {
  fl_span *span = &work->span;
  if (is_as_prepared)
    take_prepared(block, span);
  else {
    scale_of(block, span);
    basis_of(block, span);
    matrices_of(block, span);
  }
  fl_offset_wrench(block, span);
  if (prepare_newton(block, work)) return 1;
  fl_forget_span(work);
  return 0;
}

/* Has the next question prepare its state anew, as after another robot: it is like none. */
void fl_forget_span(fl_work *work) { memset(work->span.is_lost, 2, sizeof work->span.is_lost); }

/* Prepares the state in which some actuators (n,) are lost and some axes (6,) free, each 0
   for none, unless the last question had the same; 0 where its numbers are out of range. */
int fl_span_of_question(const real *block, fl_work *work, const unsigned char *lost,
                        const unsigned char *free) {
  fl_span *span = &work->span;
  int is_same = 1;
  int is_as_prepared = 1;
  for (int i = 0; i < COUNT(block); i++) {
    const unsigned char gone = lost && lost[i];
    is_same &= span->is_lost[i] == gone;
    is_as_prepared &= !gone;
    span->is_lost[i] = gone;
  }
  for (int k = 0; k < 6; k++) {
    const unsigned char prepared = HEAD(block)->is_commanded[k] != 0;
    const unsigned char counts = prepared && !(free && free[k]);
    is_same &= span->axis_counts[k] == counts;
    is_as_prepared &= counts == prepared;
    span->axis_counts[k] = counts;
  }
  if (is_same) return 1;
  work->is_whole = 0; /* what is lost has another set */
  return fl_prepare_span(block, work, is_as_prepared);
}
