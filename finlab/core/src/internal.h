/* What the files of the core share.

   Functions that one file defines and others call have the prefix fl_, as the linker sees them, and
   so has all that finlab.h and fl_work.h declare. What stands here alone has none: static inline
   functions, types, constants. */
#ifndef FL_INTERNAL_H
#define FL_INTERNAL_H
#include "finlab.h"
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
#define LOG logf
#define POW powf
#define TANH tanhf
#define FLOOR floorf
#define RINT rintf
#define FABS fabsf
#define TOLERANCE R(1e-6) /* scaled wrench that may be left of a target */
/* The same where Newton's method stands still for IDLE steps; commands make up for it. */
#define ENOUGH R(1e-4)
#define IDLE 6
#define ROUNDING R(1e-6) /* share of a sum that is rounding alone */
#define EXACT R(2e-6)    /* error of commands, over the wrench scale, that needs no further step */
#define TINY R(1e-30)
#else
#define R(x) x
#define SQRT sqrt
#define SIN sin
#define COS cos
#define ATAN2 atan2
#define EXP exp
#define LOG log
#define POW pow
#define TANH tanh
#define FLOOR floor
#define RINT rint
#define FABS fabs
#define TOLERANCE 1e-10
#define ENOUGH TOLERANCE
#define IDLE FL_STEPS
#define EXACT 1e-8
#define ROUNDING 1e-12 /* share of a sum that is rounding alone */
#define TINY 1e-300
#endif
#define TINY_WIDE 1e-300 /* of `wide`, which is in double precision always */
#define PI R(3.14159265358979323846)
#define LARGEST_NUMBER R(1e30)  /* of a block or an answer */
#define INFEASIBLE_COST R(1e30) /* [W] where no forces or commands meet a target */

/* From small to large: ROUNDING, NOTHING, NEARLY, FINE, CLOSE; docs/theory/numbers.md. */
#define NOTHING R(1e-9)    /* share below which a number counts as 0: rounding that has added up */
#define NEARLY R(1e-6)     /* share up to which two numbers count as equal */
#define FINE R(1e-5)       /* share by which a table may be off between its points */
#define CLOSE R(1e-4)      /* share of a cost that is not worth another search */
#define SAME_POINT NOTHING /* distance, over the wrench scale, up to which a point is the nearest */
#define USUAL_TICK_PARTS 60    /* fl_settings.tick_parts where nothing else is set */
#define USUAL_COMMAND_STEPS 36 /* fl_settings.command_steps where nothing else is set */

#define HEAD(block) ((const fl_head *)(block))
#define ACTUATOR(block, i) ((const fl_actuator *)((block) + sizeof(fl_head) / sizeof(real)) + (i))
#define COUNT(block) ((int)HEAD(block)->n)

static inline real larger(real a, real b) {
  if (a > b) return a;
  return b;
}

static inline real smaller(real a, real b) {
  if (a < b) return a;
  return b;
}

static inline real clipped(real x, real low, real high) { return smaller(larger(x, low), high); }

/* linear_algebra.c: linear algebra of 6 x 6 matrices */
static inline real dot(const real *a, const real *b, int n) {
  real sum = 0;
  for (int i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}
static inline real size_of(const real *force) {
  return SQRT(force[0] * force[0] + force[1] * force[1]);
}

static inline void cross(const real *a, const real *b, real *product) {
  product[0] = a[1] * b[2] - a[2] * b[1];
  product[1] = a[2] * b[0] - a[0] * b[2];
  product[2] = a[0] * b[1] - a[1] * b[0];
}

/* Adds the wrench of a force at a position: f and r x f. */
static inline void add_wrench(const real *r, const real *f, real *wrench) {
  for (int k = 0; k < 3; k++) {
    const int l = (k + 1) % 3;
    const int m = (k + 2) % 3;
    wrench[k] += f[k];
    wrench[3 + k] += r[l] * f[m] - r[m] * f[l];
  }
}

real fl_wrap_angle(real angle);
void fl_add_square(real H[6][6], const real *b, real weight);
void fl_add_equation(real H[6][6], real *right, const real *b, real weight, real value);
real fl_trace(real H[6][6]);
int fl_factor(real A[6][6]);
void fl_solve(real factor[6][6], const real *right, real *x);
int fl_are_within(const real *values, int count, real most);

/* The wrench of a command (n, 3), by the laws of fl_figures_of_command; returns what that does. */
int fl_wrench_of_command(const fl_formula *laws, int n, const real *effectiveness,
                         const real *command, real *wrench);

/* What sort of forces an actuator has, and the price of them: what files of the core ask often. */

/* Whether an actuator is a foil: a rudder in a flow that it feels, whose drag costs power. */
static inline int is_foil(const fl_actuator *a) { return a->flow_speed > 0; }

/* Whether an actuator pushes in a plane. */
static inline int is_plane(const fl_actuator *a) { return a->rows == 2 && !is_foil(a); }

/* Copies of what all n actuators have, and no more of an array of FL_MOST. */
static inline void copy_forces(const real *block, real force[][2], real to[][2]) {
  memcpy(to, force, (size_t)COUNT(block) * sizeof force[0]);
}

static inline void copy_commands(const real *block, real command[][3], real to[][3]) {
  memcpy(to, command, (size_t)COUNT(block) * sizeof command[0]);
}

static inline void copy_sets(const real *block, const fl_set *from, fl_set *to) {
  memcpy(to, from, (size_t)COUNT(block) * sizeof *to);
}

/* Prices s = B' lambda of an actuator's force along its rows [W/N], Eq. 4. */
static inline void actuator_price(const fl_work *work, int i, const real *lambda, real *s) {
  s[0] = dot(work->span.effectiveness_reduced[i][0], lambda, 6);
  s[1] = dot(work->span.effectiveness_reduced[i][1], lambda, 6);
}

/* force_table.c: tables of force over price, gauges of directions */
typedef struct {
  real force, slope, conjugate;
} line_response;
typedef struct {
  real value, slope, bend;
} gauge_point;
line_response fl_force_of_price(const real *table, real price);
real fl_marginal_cost(const real *table, real size, real *price);
gauge_point fl_gauge_support(const real *gauge, real x, real y);
real fl_gauge_radius(const real *gauge, real angle);
real fl_gauge_lean(const real *gauge, real angle);

/* Whether the forces of an actuator differ by direction, by a table. */
static inline int has_gauge_table(const fl_actuator *a) { return FL_GAUGES && a->gauge_table > 0; }

/* steered_curve.c: forces of propellers with a rudder by direction */
real fl_steered_deflection(const real *block, int i, real angle);
real fl_steered_radius(const real *block, int i, real angle);
gauge_point fl_steered_support(const real *block, int i, real x, real y);
static inline int is_steered(const fl_actuator *a) {
  return FL_SLIPSTREAMS && (int)a->command_kind == FL_STEERED;
}

/* force_set.c: what one actuator may give */
void fl_empty_set(const real *block, int i, fl_set *set);
line_response fl_unlimited_response(const real *block, const fl_actuator *a, real price);
line_response fl_limited_response(const real *block, const fl_actuator *a, const fl_set *set,
                                  int line, real price);
void fl_limit_set(const real *block, int i, fl_set *set, real low, real high, real middle,
                  real half);
void fl_prepare_set(const real *block, int i, fl_set *set);
void fl_fix_force(const real *block, int i, fl_set *set, const real *force);
real fl_power_and_price(const real *block, int i, real force, real *price);
real fl_largest_slope(const real *block, int i);
fl_set fl_reversed_set(const fl_set *set);

/* actuator_response.c: forces that are worth most at multipliers, Eq. 5 */
typedef struct {
  real force[2];   /* y [N] */
  real xx, xy, yy; /* dy/ds [N^2/W] */
  real conjugate;  /* c*(s) [W] */
  real angle;      /* at which it pushes, where turning costs [rad] */
} response;
response fl_response(const real *block, int i, const fl_set *set, const real *price);
#define BLEND_REST R(1e-12) /* least width omega [W] of a blend */
/* omega [W] of a blend of two responses whose largest force costs so much. */
static inline real blend_width(real high_cost) { return FINE * high_cost + BLEND_REST; }
real fl_radius(const real *block, int i, real angle);
real fl_limited_size(const real *block, int i, const fl_set *set, const real *force);
real fl_support_of_set(const real *block, int i, const fl_set *set, const real *price, wide *force,
                       real *slope);
real fl_drag_of_lift(const real *block, int i, real force);
int fl_undecided(const real *block, int i, const fl_set *set, const real *price, real *off);

/* line_pairs.c: responses of lines, two at a time */
static inline void read_price_table(const real *block, int offset, fl_price_table *table) {
  const real *numbers = block + offset;
  table->offset = offset + 3;
  table->price_max = numbers[0];
  table->over_price = 1 / numbers[0];
  table->cells = numbers[1];
  table->each = 1 / numbers[1];
  const real *last = numbers + 3 + 3 * (int)numbers[1];
  table->force_max = last[0];
  table->conjugate_max = last[2];
}
void fl_prepare_lines(const real *block, fl_work *work);
void fl_add_lines(const real *block, const fl_work *work, const real *lambda, fl_state *state,
                  real *wrench, real *conjugate);

/* turning_cost.c: responses where turning costs */
response fl_response_with_turning(const real *block, int i, const fl_set *set, const real *price);
int fl_has_jumped(const real *block, int i, const fl_set *set, const fl_state *one,
                  const fl_state *other, const real *step, int is_short);
void fl_mark_jump(fl_set *set, real one, real other);

/* effectiveness.c: what the actuators that work span in the axes that count */
int fl_prepare_span(const real *block, fl_work *work, int is_as_prepared);
void fl_offset_wrench(const real *block, fl_span *span);
void fl_reduce_effectiveness(const real *block, fl_work *work);
void fl_forget_span(fl_work *work);
int fl_span_of_question(const real *block, fl_work *work, const unsigned char *lost,
                        const unsigned char *free);

/* answer.c: forces for one wrench */
void fl_find_forces(const real *block, fl_work *work, const real *wrench_wanted,
                    const fl_policy *policy, const real *lambda, fl_answer *out);
int fl_is_missed(real error);

/* idle_actuators.c: actuators that give nothing in a tick */
int fl_may_give_later(const real *block, const fl_work *work, int has_missed, real command[][3]);
void fl_prepare_idle(const real *block, fl_work *work, const fl_question *q,
                     const real *wrench_desired, real command[][3]);

/* command_form.c: what the numbers of each kind of command are */
enum { NO_NUMBER = -1 };
enum { NO_TABLE, BEAT_TABLE, CURVE_TABLE, ENDS_TABLE }; /* kinds of command tables, see fl_work.h */
typedef struct {
  signed char numbers;       /* how many of the three a command uses, from the first one on */
  signed char angle_number;  /* which one is an angle that wraps, or NO_NUMBER */
  signed char force_number;  /* which one is a force, which may have a dead band, or NO_NUMBER */
  signed char command_table; /* what fl_actuator.command_table is: BEAT_TABLE ... */
  signed char has_law_grid;  /* whether the law is a grid */
  signed char has_drag;      /* whether the second axis of the law is drag */
  signed char reverses_straight; /* whether in reverse it pushes against its first axis */
} command_form;
const command_form *fl_form_of(const fl_actuator *a);
int fl_aims_force(const fl_actuator *a);
int fl_is_in_reverse(const fl_actuator *a, const real *command);

/* command_box.c: commands within their limits */
int fl_is_known_command(const real *command);
void fl_clip_commands(const real *block, const fl_box *box, real command[][3]);
real fl_clip_number(const fl_box *box, int i, int k, int angle, real value);
void fl_leave_dead_bands(const real *block, real force[][2], real command[][3]);
void fl_rest_in_dead_bands(const real *block, const fl_box *box, real command[][3]);
int fl_is_in_dead_band(const fl_actuator *a, const real *command);

/* barred_zones.c: angles between the arcs of a pod */
#if FL_ZONES > 0
int fl_has_barred_zone(const fl_actuator *a, const fl_set *set);
int fl_is_barred(const fl_actuator *a, const fl_set *set, const real *force);
void fl_narrow_by_zone(const fl_actuator *a, fl_set *set, const real *force, int side);
void fl_trim_arc(const fl_actuator *a, real *low, real *high);
real fl_leave_zone(const fl_actuator *a, real angle);
void fl_keep_arcs(const real *block, fl_box *box, real command[][3]);
#else /* no pod has any, so the compiler leaves out what is done about them */
static inline int fl_has_barred_zone(const fl_actuator *a, const fl_set *set) {
  (void)a;
  (void)set;
  return 0;
}
static inline int fl_is_barred(const fl_actuator *a, const fl_set *set, const real *force) {
  (void)a;
  (void)set;
  (void)force;
  return 0;
}
static inline void fl_narrow_by_zone(const fl_actuator *a, fl_set *set, const real *force,
                                     int side) {
  (void)a;
  (void)set;
  (void)force;
  (void)side;
}
static inline void fl_trim_arc(const fl_actuator *a, real *low, real *high) {
  (void)a;
  (void)low;
  (void)high;
}
static inline real fl_leave_zone(const fl_actuator *a, real angle) {
  (void)a;
  return angle;
}
static inline void fl_keep_arcs(const real *block, fl_box *box, real command[][3]) {
  (void)block;
  (void)box;
  (void)command;
}
#endif

/* command_law.c: forces of commands and commands for forces */
typedef struct {
  real low, high, middle, half;
} force_range;
void fl_force_of_command(const real *block, int i, const real *command, real *force,
                         real (*slope)[3]);
void fl_command_for_force(const real *block, int i, const fl_box *box, const real *force,
                          const real *before, real *command);
force_range fl_force_range(const real *block, int i, const fl_box *box);
void fl_commands_for_forces(const real *block, const fl_box *box, real force[][2],
                            const real *previous, real command[][3]);
real fl_power_of_commands(const real *block, const fl_work *work, real command[][3],
                          real force[][2]);

/* command_refine.c: steps on the commands, Eq. 11 */
real fl_refine_commands(const real *block, fl_work *work, const fl_box *box, const real *wrench,
                        real command[][3], int steps);

void fl_step_commands(const real *block, fl_work *work, const fl_box *box, const real *residual,
                      real mu, real command[][3], real stepped[][3]);

/* Arrays of answers, one after the other: the outputs of fl_answer_many. */
typedef struct {
  real *force;
  real *multipliers;
  real *wrench_served;
  real *command;
  fl_byte *is_attainable;
  real *error;
  fl_byte *is_truncated;
} answer_arrays;

/* Writes answer k into the arrays. */
static inline void write_answer_of(const real *block, const fl_answer *answer, int k,
                                   const answer_arrays *to) {
  const size_t n = (size_t)COUNT(block);
  const size_t row = (size_t)k;
  memcpy(to->force + 2 * n * row, answer->force, 2 * n * sizeof(real));
  memcpy(to->multipliers + 6 * row, answer->multipliers, sizeof answer->multipliers);
  memcpy(to->wrench_served + 6 * row, answer->wrench_served, sizeof answer->wrench_served);
  memcpy(to->command + 3 * n * row, answer->command, 3 * n * sizeof(real));
  to->is_attainable[k] = (fl_byte)answer->is_attainable;
  to->error[k] = answer->error;
  to->is_truncated[k] = (fl_byte)answer->is_truncated;
}

/* feasible_set.c: what may be given now */
void fl_limits_without_tick(const real *block, fl_work *work);
void fl_limits_of_tick(const real *block, fl_work *work, const fl_question *q);
int fl_prepare_question(const real *block, fl_work *work, const fl_question *q);

/* first_multipliers.c: where Newton's method on the dual begins. The numbers are those of lanes,
   too. */
/* First mu where an actuator may be at its limit; NEARLY elsewhere. */
#define MU_NEAR_LIMIT R(1e-1)
#define NEAR_LIMIT R(0.8) /* share of the largest force from which an actuator may be there */
void fl_first_lambda(const real *block, const fl_work *work, const real *target_reduced,
                     real *lambda, real *mu);
void fl_first_lambda_at_rim(const real *block, fl_work *work, const real *target_reduced,
                            const real *normal, real *lambda);
void fl_first_lambda_inside(const real *block, fl_work *work, const real *target_reduced,
                            const real *normal, real inside, real *lambda);

/* dual_newton.c: Newton's method on the dual, Eq. 8. The numbers are those of lanes, too. */
#define SATURATED R(1e-1) /* share c of M */
/* Share of TOLERANCE, below which no step follows: near the rim multipliers magnify what is left,
   and whoever takes other steps has to come to the same ones. */
#define SURE_SHARE R(0.1)
#define FELL R(0.9)           /* a residual above this share of the last one has not improved */
#define MU_SINGULAR 10        /* mu grows by this where the step's matrix is singular to rounding */
#define MU_KEPT_LEAST R(0.05) /* mu after a kept step, over that before: at least */
#define MU_KEPT_EARLY R(0.3)  /* the same where more than half of the slope is left at its end */
#define SHARE_LEAST R(0.01)   /* of a refused step, the least share that is tried next */
#define SHARE_LEAST_AT_KINK R(1e-3) /* the same where sets have kinks */
#define SHARE_MOST R(0.7)           /* the largest one */
#define WRENCH_MIN R(1e-3) /* what a scaled wrench counts at least, in rounding of its range */
void fl_prepare_sets(const real *block, fl_work *work);
void fl_find_kinks(const real *block, fl_work *work);
void fl_restore_sets(const real *block, fl_work *work, const fl_set *set);
void fl_dual_start(const real *block, fl_work *work, const real *target_reduced,
                   const real *lambda);
void fl_dual_at(const real *block, const fl_work *work, const real *target_reduced,
                const real *lambda, fl_state *state);
int fl_dual_newton(const real *block, fl_work *work, const real *target_reduced, const real *lambda,
                   int most_steps);
void fl_reduce_wrench(const fl_work *work, const real *wrench, real *target_reduced);
void fl_reduce_lambda(const fl_work *work, const real *lambda, real *lambda_reduced);
int fl_is_in_range(const fl_work *work, const real *wrench, const real *target_reduced);
void fl_wrench_of_forces(const real *block, const fl_work *work, real force[][2], real *wrench);

/* power_budget.c: power that buses may take */
int fl_exceeds_budget(const real *block, const fl_work *work, const fl_budget *budget,
                      real force[][2]);
int fl_keep_budget(const real *block, fl_work *work, const real *wrench, const fl_policy *policy,
                   const fl_budget *budget, fl_answer *out);

/* set_gaps.c: sets with gaps */
#define NARROW R(0.2)   /* half of an arc up to which its chord stands for its least forces */
#define SHORTER R(0.98) /* a force below this share of the least one lies in the gap at rest */
int fl_worst_gap(const real *block, const fl_work *work, real force[][2], const real *lambda);
int fl_nearer_side(const real *block, int i, const fl_set *set, const real *force);
int fl_may_have_gaps(const real *block, const fl_work *work, real force[][2]);
real fl_gap_of(const real *block, const fl_work *work, int i, const real *force, real largest,
               const real *lambda);
real fl_largest_force(const real *block, real force[][2]);
void fl_fix_at_least_force(const real *block, int i, fl_set *set, const real *force);
void fl_narrow_set(const real *block, int i, fl_set *set, const real *force, int side);
fl_cut *fl_cut_set(const real *block, fl_work *work, int *depth, int i, const real *force);
void fl_take_side(const real *block, fl_work *work, const fl_cut *cut, int side);
fl_cut *fl_last_open_cut(const real *block, fl_work *work, int *depth);

/* gap_search.c: least power where sets have gaps */
/* What is solved for each part of the sets: the dual of a target, or with `solve` another problem,
   whose dual value work->state_found has afterwards. */
typedef struct {
  const real *target_reduced;
  int (*solve)(void *data); /* finds the optimum from where it is; returns FL_MET ... */
  void (*keep)(void *data); /* what it has found is the best so far */
  void *data;
} fl_part_problem;
int fl_search_gaps(const real *block, fl_work *work, const real *target_reduced, int status,
                   real *bound);
int fl_search_parts(const real *block, fl_work *work, const fl_part_problem *problem, int status,
                    real *bound);
real fl_gap_power_bound(const fl_work *work, real bound);
int fl_answer_with_drag(const real *block, fl_work *work, const real *wrench_wanted,
                        const real *target_reduced, int status, fl_answer *out);

/* foil_tangent.c: a foil near to a command */
const real *fl_lift_end(const real *block, const fl_actuator *a);
void fl_foil_at(const real *block, int i, real angle, fl_tangent *tangent);
void fl_draw_tangent(const real *block, int i, const fl_box *box, real angle, const real *s,
                     fl_tangent *tangent, fl_set *set);

/* foil_jump.c: where the lift of a foil jumps */
int fl_go_to_jump(const real *block, const fl_work *work, const real *target_reduced,
                  const real *step, real slope, const fl_state *from, fl_state *trial);
int fl_is_drag_welcome(const real *block, const fl_work *work, const real *lambda);

/* foil_lattice.c: where searches for commands of foils may begin */
enum { BRANCHES = 4 };   /* of a foil's lift */
#define LATTICE_FOILS 6  /* foils on the lattice at most; others begin at rest */
#define LATTICE_NODES 48 /* nodes of all foils at most, angles of which a point has one a foil */
typedef struct {
  int foils;                              /* how many there are */
  int foil[LATTICE_FOILS];                /* which actuators these are */
  int branches[LATTICE_FOILS];            /* of each foil */
  int first[LATTICE_FOILS];               /* its first node */
  int each;                               /* nodes on a branch */
  real edge[LATTICE_FOILS][BRANCHES + 1]; /* ends of the branches [rad] */
  real angle[LATTICE_NODES];              /* of each node [rad] */
  real cost[LATTICE_NODES];               /* of each node [W] */
  real wrench[LATTICE_NODES][6];          /* of each node, in the basis */
  real row[FL_MOST][2][6];                /* of other actuators: force by a wrench in the basis */
} foil_lattice;
typedef struct {
  unsigned char node[LATTICE_FOILS]; /* of each foil */
  real cost;                         /* [W], with the price of a miss */
} lattice_point;
struct foil_choices;
void fl_lay_lattice(const real *block, const fl_work *work, foil_lattice *lattice);
int fl_cheapest_points(const real *block, const fl_work *work, const foil_lattice *lattice,
                       const real *target_reduced, const struct foil_choices *choices_left,
                       lattice_point *points);
int fl_branch_of_choice(const foil_lattice *lattice, int choice, int foil);
void fl_commands_of_point(const real *block, const fl_work *work, const foil_lattice *lattice,
                          const real *target_reduced, const lattice_point *point, fl_box *box,
                          real command[][3]);

/* foil_arcs.c: foils that may stall, beyond reach */
static inline int has_arc(const fl_set *set) { return FL_ARCS > 0 && set->arc; }

/* Whether a set in reverse is straight against its first axis, at any deflection. */
static inline int reverses_straight(const fl_set *set) {
  return FL_SLIPSTREAMS && set->reverses_straight;
}
void fl_lay_arcs(const real *block, fl_work *work);
#if FL_ARCS > 0
void fl_farthest_on_arc(const fl_set *set, const real *price, wide *force);
real fl_gap_of_arc(const fl_actuator *a, const fl_set *set, const real *force);
int fl_nearer_side_of_arc(const fl_set *set, const real *force);
void fl_narrow_arc(fl_set *set, const real *force, int side);
#else /* a robot without foils has no arcs */
static inline void fl_farthest_on_arc(const fl_set *set, const real *price, wide *force) {
  (void)set;
  (void)price;
  (void)force;
}
static inline real fl_gap_of_arc(const fl_actuator *a, const fl_set *set, const real *force) {
  (void)a;
  (void)set;
  (void)force;
  return 0;
}
static inline int fl_nearer_side_of_arc(const fl_set *set, const real *force) {
  (void)set;
  (void)force;
  return 1;
}
static inline void fl_narrow_arc(fl_set *set, const real *force, int side) {
  (void)set;
  (void)force;
  (void)side;
}
#endif
real fl_lay_closer_arcs(const real *block, fl_work *work, int is_first, real force[][2]);
void fl_commands_on_arcs(const real *block, const fl_work *work, real force[][2],
                         real command[][3]);

/* foil_choices.c: branches of foils' lifts on which cheaper commands may be */
enum { ANY_BRANCH = -1 };
typedef struct foil_choices {
  real dual_value;                      /* at the multipliers of the regrets [W] */
  real cost_of_use;                     /* commands that cost more are of no use [W] */
  real regret[LATTICE_FOILS][BRANCHES]; /* worth that a foil has less on each branch [W] */
  int known_branch[LATTICE_FOILS];      /* of each foil in commands that are known */
  int has_known;                        /* whether there are such commands */
} foil_choices;
void fl_find_choices(const real *block, const fl_work *work, const foil_lattice *lattice,
                     real cost_of_use, foil_choices *choices);
void fl_leave_out_choice(const foil_lattice *lattice, real command[][3],
                         const unsigned char *is_on_any, foil_choices *choices);
int fl_is_choice_left(const foil_lattice *lattice, const foil_choices *choices, int choice);
int fl_is_proved_dearer(const real *block, fl_work *work, const foil_lattice *lattice,
                        const real *target_reduced, const real *lambda, real cost_of_use,
                        const lattice_point *point);

/* foil_vertices.c: lifts of foils that the dual leaves between their ends */
#define VERTEX_FOILS 6 /* such foils at most; others stay where they are */
typedef struct {
  int foils;                    /* how many there are */
  int foil[VERTEX_FOILS];       /* which actuators these are */
  real column[VERTEX_FOILS][6]; /* of each: wrench by its lift that no others make up for */
  real size[VERTEX_FOILS];      /* of each: size of that wrench, whoever makes up for it */
  int directions;               /* in the lifts along which the wrench stays */
  int count;                    /* of vertices */
} foil_vertices;
void fl_find_vertices(const real *block, const fl_work *work, foil_vertices *vertices);
void fl_go_to_vertex(const fl_work *work, const foil_vertices *vertices, int vertex,
                     unsigned char *is_held, real force[][2]);

/* foil_steps.c: steps on the commands of robots with foils */
real fl_approach(const real *block, fl_work *work, const fl_box *box, real command[][3]);
int fl_come_to_give(const real *block, fl_work *work, const fl_box *box, real command[][3],
                    int steps, real most_error);
real fl_error_allowed(const real *block, const fl_work *work, const fl_box *box);
real fl_meet_and_cheapen(const real *block, fl_work *work, const real *target_reduced,
                         real most_error, real *lambda, real command[][3], real force[][2]);

/* foil_drag.c: commands of robots whose foils drag */
void fl_improve_commands(const real *block, fl_work *work, const real *target_reduced,
                         real *best_cost);
void fl_improve_from_starts(const real *block, fl_work *work, const real *target_reduced,
                            real *best_cost);
int fl_is_done_by_foils(const real *block, const fl_work *work, real best_cost);
int fl_take_sure_forces(const real *block, fl_work *work);
int fl_may_any_stall(const real *block, const fl_work *work);
void fl_improve_from(const real *block, fl_work *work, const real *target_reduced,
                     const real *lambda, real command[][3], real *best_cost);
void fl_largest_ray_share(const real *block, fl_work *work, const real *wrench, real start[][3],
                          real found, real most, fl_answer *out);

/* nearest_point.c: points near to a wrench beyond reach */
/* Rounding of shares and misses, which are in double precision always. */
#define BARELY ((wide)NEARLY * NEARLY)
static inline wide dot_wide(const wide *a, const wide *b, int n) {
  wide sum = 0;
  for (int k = 0; k < n; k++) sum += a[k] * b[k];
  return sum;
}

static inline wide larger_wide(wide a, wide b) {
  if (a > b) return a;
  return b;
}

static inline wide norm_wide(const wide *a) { return sqrt(dot_wide(a, a, 6)); }

/* Adds a vector (6,) times a number. */
static inline void add_scaled(wide *to, wide times, const wide *other) {
  for (int k = 0; k < 6; k++) to[k] += times * other[k];
}
wide fl_normalized_axis(const real *block, const fl_work *work, const real *reduced, int axis);
void fl_weigh_axes(const real *block, fl_work *work, const wide *weight);
void fl_point_of_forces(const real *block, const fl_work *work, wide force[][2], wide *point);
wide fl_nearest_point(const real *block, const fl_work *work, const wide *target_weighted,
                      wide close, wide apart, fl_mixture *m);
wide fl_farthest_along_ray(const real *block, const fl_work *work, const wide *from,
                           const wide *ray, wide least, wide most, wide close, fl_mixture *m,
                           wide *plane);
void fl_mixed_forces(const real *block, const fl_mixture *m, real force[][2]);

#ifdef FL_WITH_POWER_SETS
/* power_sets.c: the farthest forces within power budgets. A side is a convex set of forces of one
   actuator, from a share of its largest ones on, whose power grows with that share; Python writes
   it, as `Side.numbers` of finlab/forces/power_sides.py. */
typedef struct {
  real polygon; /* offset of its corners in the tables, a count and pairs [N]; 0 for a sector */
  real radius;  /* of a sector [N] */
  real center;  /* of its arc [rad] */
  real half_angle;
  real least_share; /* of the largest forces [1] */
  real watts;       /* of the largest forces: a share g takes watts g^exponent */
  real exponent;
  real curve; /* offset of knots in the tables, in place of that: a count, and of each a share, its
                 power [W], and the slope of that; else 0 */
} fl_power_side;
#define NUMBERS_OF_ACTUATOR 16 /* of fl_power_sets */
struct fl_power_sets {
  const real *tables;
  const fl_power_side *side;
  const real *actuator; /* (n, 16): first side, how many, bus or -1, whether it works; then the
                           wrench (2, 6) per newton along both directions */
  const real *budget;   /* (buses,) [W] */
  int buses;
  wide multiplier[FL_BUSES]; /* of the budgets, at the last normal */
  wide expected[FL_BUSES];   /* the same over its length, where it was above 0 */
  int *corner;               /* of each side, the farthest one at the last normal */
};
#define FL_SIDES_MOST 2560 /* of FL_MOST actuators: five arcs each, as two halves */
void fl_farthest_within_budgets(fl_power_sets *sets, int n, const wide *normal, wide force[][2]);
void fl_smooth_normal(const real *block, const fl_work *work, const wide *from, const wide *ray,
                      wide close, wide *normal);
#endif

/* support_newton.c: the same by normals of the set */
int fl_nearest_by_normal(const real *block, const fl_work *work, const wide *target_weighted,
                         const wide *normal, wide close, fl_mixture *m);
int fl_has_lines_alone(const real *block);
int fl_end_of_ray_by_normal(const real *block, const fl_work *work, const wide *from,
                            const wide *ray, const wide *normal, wide close, fl_mixture *m);

/* outer_reach.c: answers where actuators act on each other, beyond reach */
void fl_serve_coupled(const fl_coupled_robot *robot, real *block, fl_work *work,
                      const fl_question *q, fl_answer *answer, const fl_outer_result *result);

/* outer_iterations.c: answers where actuators act on each other, from one start */
real fl_refine_coupled(const fl_coupled_robot *robot, real *block, fl_work *work, const fl_box *box,
                       const real *wrench, real enough, int most_steps, real command[][3]);
void fl_coupled_wrench(const fl_coupled_robot *robot, real *block, fl_work *work, real command[][3],
                       real *wrench);
void fl_box_of_question(const real *block, fl_work *work, const fl_question *q, fl_box *box);
typedef struct {
  real (*force)[2]; /* of lines (n, 2) [N] */
  real power;       /* [W] */
} known_end;
real fl_linearize_coupled(const fl_coupled_robot *robot, real *block, fl_work *work,
                          const real *wrench, real command[][3], int is_chord, real *residual);
real fl_exact_penalty(const real *block, const real *lambda);
int fl_leads_to_known(const real *block, const known_end *known, real force[][2], real power);
int fl_iterations_from(const fl_coupled_robot *robot, real *block, fl_work *work,
                       const fl_question *question, const fl_outer_limits *limits,
                       const known_end *known, real force[][2], fl_answer *answer,
                       fl_outer_result *result);

/* outer_newton.c: the same of lines, where a few steps of Newton's method are enough. From forces,
   which become those at which it ends, and multipliers of the question; returns how. */
enum {
  NEWTON_MET,   /* at an answer */
  NEWTON_KNOWN, /* on its way to forces that are known */
  NEWTON_LEFT   /* at nothing */
};
int fl_newton_from(const fl_coupled_robot *robot, real *block, fl_work *work,
                   const fl_question *question, const known_end *known, real force[][2],
                   fl_answer *answer, fl_outer_result *result);

/* out_of_reach.c: what a policy gives beyond reach */
void fl_out_of_reach(const real *block, fl_work *work, const real *wrench, const fl_policy *policy,
                     fl_answer *out);

#endif
