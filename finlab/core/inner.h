/* What the files of the core share. */
#ifndef FINLAB_INNER_H
#define FINLAB_INNER_H
#include "core.h"
#include <math.h>
#include <string.h>

typedef fl_real real;
typedef fl_wide wide;
#ifdef FL_SINGLE
#define R(x) x##f
#define SQRT sqrtf
#define SIN sinf
#define COS cosf
#define ATAN2 atan2f
#define EXP expf
#define TANH tanhf
#define FLOOR floorf
#define FABS fabsf
#define TOLERANCE R(1e-6) /* scaled wrench that may be left of a target */
#define ENOUGH R(1e-4) /* the same where Newton's method stands still for IDLE steps; commands make up for it */
#define IDLE 6
#define ROUNDING R(1e-6)
#define EXACT R(2e-6) /* error of commands, on the yardstick, that needs no further step */
#define TINY R(1e-30)
#else
#define R(x) x
#define SQRT sqrt
#define SIN sin
#define COS cos
#define ATAN2 atan2
#define EXP exp
#define TANH tanh
#define FLOOR floor
#define FABS fabs
#define TOLERANCE 1e-10
#define ENOUGH TOLERANCE
#define IDLE MOST_STEPS
#define EXACT 1e-8
#define ROUNDING 1e-12
#define TINY 1e-300
#endif
#define PI R(3.14159265358979323846)
#define NOTHING R(1e-9)
#define CLOSE_BY NOTHING /* distance, on the yardstick, up to which a point is the nearest one */
#define NEARLY R(1e-6)
#define FINE R(1e-5)
#define CLOSE R(1e-4)
#define ROUNDS 12
#define LAST_STEPS 36 /* of Levenberg and Marquardt that end an answer; most end after three */
#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define CLIP(x, low, high) MIN(MAX(x, low), high)

#define HEAD(block) ((const fl_head *)(block))
#define ACTUATOR(block, i) ((const fl_actuator *)((block) + sizeof(fl_head) / sizeof(real)) + (i))
#define COUNT(block) ((int)HEAD(block)->n)

/* linear.c */
static inline real dot(const real *a, const real *b, int n) {
  real sum = 0;
  for (int i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}
static inline real size_of(const real *force) { return SQRT(force[0] * force[0] + force[1] * force[1]); }
real wrapped(real angle);
void add_square(real h[6][6], const real *b, real weight);
real trace_of(real h[6][6]);
int factor(real a[6][6]);
void solve(real a[6][6], const real *right, real *x);

/* Whether an actuator pushes in a plane. */
static inline int is_plane(const fl_actuator *a) { return a->rows == 2 && a->speed == 0; }
/* Prices of an actuator's rows at prices of the wrench in the basis. */
static inline void own_price(const fl_work *work, int i, const real *price, real *own) {
  own[0] = dot(work->span.matrix[i][0], price, 6);
  own[1] = dot(work->span.matrix[i][1], price, 6);
}

/* span.c */
int span_anew(const real *block, fl_work *work, int is_as_prepared);
void beside_of(const real *block, fl_span *span);
int span_now(const real *block, fl_work *work, const unsigned char *lost, const unsigned char *free);

/* table.c */
typedef struct { real force, slope, conjugate; } along;
along radial(const real *table, real price);
real marginal(const real *table, real size, real *price);
typedef struct { real value, slope, bend; } support;
support gauge_support(const real *gauge, real x, real y);
real gauge_at(const real *gauge, real angle);
real lean_at(const real *gauge, real angle);

/* reply.c */
typedef struct { real force[2], xx, xy, yy, conjugate, angle; } reply; /* angle: where turning costs */
void leave_out(const real *block, int i, fl_set *set);
along limited(const real *block, const fl_actuator *a, const fl_set *set, int line, real price);
void limit(const real *block, int i, fl_set *set, real low, real high, real middle, real half);
void set_up(const real *block, int i, fl_set *set);
void freeze(const real *block, int i, fl_set *set, const real *force);
real cost_at(const real *block, int i, real force);
reply reply_of(const real *block, int i, const fl_set *set, const real *price);
real farthest_of(const real *block, int i, const fl_set *set, const real *price, wide *force);
fl_set reversed(const fl_set *set);
real drag_of(const real *block, int i, real force);
int undecided(const real *block, int i, const fl_set *set, const real *price, real *off);

/* turning.c */
reply turned(const real *block, int i, const fl_set *set, const real *price);
int has_jumped(const real *block, int i, const fl_set *set, const fl_state *one, const fl_state *other,
               const real *step, int is_short);
void mark_jump(fl_set *set, real one, real other);

/* newton.c */
#define MOST_STEPS 200
void sums_of(const real *block, fl_work *work);
void take_sets(const real *block, fl_work *work, const fl_set *set);
void stand_at(const real *block, fl_work *work, const real *target, const real *price);
void look(const real *block, const fl_work *work, const real *target, const real *price, fl_state *state);
void first_price(const real *block, const fl_work *work, const real *target, real *price, real *ridge);
int newton(const real *block, fl_work *work, const real *target, const real *price, int most);
void to_basis(const fl_work *work, const real *wrench, real *target);
void price_in_basis(const fl_work *work, const real *price, real *inner);
int in_range(const fl_work *work, const real *wrench, const real *target);
void wrench_of(const real *block, const fl_work *work, real force[][2], real *wrench);

/* gaps.c */
#define NARROW R(0.2) /* half of an arc up to which the chord stands for the arc of the least forces */
#define STEPS_AT_KINK 60 /* Newton's steps after which a target at a gap is left to its parts */
int worst_gap(const real *block, const fl_work *work, real force[][2], const real *price);
int nearer_side(const real *block, int i, const fl_set *set, const real *force);
int may_have_gaps(const real *block, const fl_work *work, real force[][2]);
void narrow(const real *block, int i, fl_set *set, const real *force, int side);
fl_node *cut_at(const real *block, fl_work *work, int *depth, int cut, const real *force);
void take_side(const real *block, fl_work *work, const fl_node *node, int side);
fl_node *last_open(const real *block, fl_work *work, int *depth);
int least_power(const real *block, fl_work *work, const real *target, int status, real *value);

/* drag.c */
real cost_of(const real *block, const fl_work *work, real command[][3], real force[][2]);
void place(const real *block, fl_work *work, const real *target, real *best);
void place_starts(const real *block, fl_work *work, const real *target, real *best);
int with_drag(const real *block, fl_work *work, const real *target, int status, fl_answer *out);
void on_ray(const real *block, fl_work *work, const real *wrench, real found, real most, fl_answer *out);

/* nearest.c */
static inline wide product(const wide *a, const wide *b, int n) {
  wide sum = 0;
  for (int k = 0; k < n; k++) sum += a[k] * b[k];
  return sum;
}

static inline wide length_of(const wide *a) { return sqrt(product(a, a, 6)); }

/* Adds a vector (6,) so many times. */
static inline void add(wide *to, wide times, const wide *other) {
  for (int k = 0; k < 6; k++) to[k] += times * other[k];
}
wide out_of_basis(const real *block, const fl_work *work, const real *inner, int axis);
void weigh(const real *block, fl_work *work, const wide *weight);
void point_of(const real *block, const fl_work *work, wide force[][2], wide *point);
wide nearest_point(const real *block, const fl_work *work, const wide *target, wide close, wide apart, fl_mixture *m);
wide farthest_along(const real *block, const fl_work *work, const wide *from, const wide *ray, wide least, wide most,
                    wide close, fl_mixture *m, wide *plane);
void mixed_force(const real *block, const fl_mixture *m, real force[][2]);

/* law.c */
void force_of(const real *block, int i, const real *command, real *force, real (*slope)[3]);
void command_for(const real *block, int i, const fl_box *box, const real *force, const real *before, real *command);
typedef struct { real low, high, middle, half; } reach;
reach reach_of(const real *block, int i, const fl_box *box);

/* now.c */
void whole_limits(const real *block, fl_work *work);
void tick_limits(const real *block, fl_work *work, const fl_question *q);
int is_known(const real *command);
int stand_as(const real *block, fl_work *work, const fl_question *q);
void into_box(const real *block, const fl_box *box, real command[][3]);

/* command.c */
int angle_of(const fl_actuator *a);
real held_in(const fl_box *box, int i, int k, int angle, real value);
void commands_for(const real *block, const fl_box *box, real force[][2], const real *previous, real command[][3]);
real refine(const real *block, fl_work *work, const fl_box *box, const real *aim, real command[][3], int steps);
void leave_bands(const real *block, real force[][2], real command[][3]);
void rest_in_bands(const real *block, const fl_box *box, real command[][3]);
int force_number(const fl_actuator *a);
int is_in_band(const fl_actuator *a, const real *command);

/* policy.c */
void in_its_place(const real *block, fl_work *work, const real *wrench, const fl_policy *policy, fl_answer *out);
#endif
