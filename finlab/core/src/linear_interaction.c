/* What jets take, by a model that is linear in its weights: a sum of formulas of jets, and of
   messages whose factors are polynomials of their features.

   finlab/interaction/linear.py says what the weights are, and makes the constants. */
#include "internal.h"

/* The polynomials of the k factors of a kind of message in its f features x:

     value = c + x.g1 + x.g2 + x.g3,  gradient = g1 + 2 g2 + 3 g3,

   where g1 (k, f) is constant, g2 = sum_j x_j A_j and g3 = sum_{j <= l} x_j x_l C_jl. Constants are
   c (k,), g1, the A_j (f, k, f) and, of degree 3, the C_jl (f (f + 1) / 2, k, f). */
typedef struct {
  int factors, features, degree;
} polynomial_form;

#define MOST_ENTRIES 44 /* factors times features */

static const polynomial_form FORMS[2] = {
    [FL_PAIR_MESSAGE] = {4, 11, 2},
    [FL_HULL_MESSAGE] = {3, 7, 3},
};

/* Constants of a robot. Behind them are a `disc` for each actuator, `formulas` times a weight and
   the constants of fl_jets, those of the messages, and the coefficients of their polynomials, pairs
   first. */
typedef struct {
  real n;
  real formulas;
  real formula_size; /* numbers of the constants of fl_jets */
  real message_size; /* numbers of the constants of the messages */
  real density;      /* of the water [kg/m^3] */
} linear_head;

/* What a flow takes of an actuator, whose jet has a speed V0: of its force F the shares c1 q + c2 q
   |q|, q = v.a / V0, by the speed along it, and the force c3 V0 v_across. */
typedef struct {
  real position[3];  /* [m] */
  real area;         /* [m^2] */
  real thrust_still; /* left where there is no force [N] */
  real lost;         /* c1 */
  real lost_squared; /* c2 */
  real side;         /* c3 [kg/m] */
} disc;

#define SMALL_RATIO R(1e-2) /* q to which its size is rounded off */

static int coefficient_count(const polynomial_form *form) {
  const int f = form->features;
  const int entries = form->factors * f;
  int count = form->factors + entries + f * entries;
  if (form->degree == 3) count += f * (f + 1) / 2 * entries;
  return count;
}

/* Adds a multiple of numbers to others. */
static inline void add_multiple(real weight, const real *numbers, int count, real *sum) {
  for (int k = 0; k < count; k++) sum[k] += weight * numbers[k];
}

/* Values (k,) and gradients (k, f) of the polynomials. Sums run over entries side by side, which
   compilers do several at a time. */
static inline void evaluate(const polynomial_form *form, const real *coefficients, const real *x,
                            real *values, real *gradients) {
  const int f = form->features;
  const int entries = form->factors * f;
  const real *linear = coefficients + form->factors;
  const real *next = linear + entries;
  real once[MOST_ENTRIES] = {0};
  real twice[MOST_ENTRIES] = {0};
  for (int j = 0; j < f; j++, next += entries) add_multiple(x[j], next, entries, once);
  for (int j = 0; j < f && form->degree == 3; j++) {
    for (int l = j; l < f; l++, next += entries) add_multiple(x[j] * x[l], next, entries, twice);
  }
  for (int k = 0; k < form->factors; k++) {
    values[k] = coefficients[k];
    for (int i = 0; i < f; i++) {
      const int m = k * f + i;
      values[k] += x[i] * (linear[m] + once[m] + twice[m]);
      if (gradients) gradients[m] = linear[m] + 2 * once[m] + 3 * twice[m];
    }
  }
}

/* An fl_factors_of. */
static void factors_of(const real *weights, int kind, const real *features, real *factors,
                       real *jacobian) {
  if (kind == FL_PAIR_MESSAGE) {
    evaluate(FORMS + FL_PAIR_MESSAGE, weights, features, factors, jacobian);
    return;
  }
  weights += coefficient_count(FORMS + FL_PAIR_MESSAGE);
  evaluate(FORMS + FL_HULL_MESSAGE, weights, features, factors, jacobian);
}

/* Adds what a velocity v [m/s] through the water takes of an actuator. */
static void add_flow(const disc *d, real density, const real *force, const real *v, real *change,
                     real *offset, real *slope) {
  const real thrust = SQRT(dot(force, force, 3) + d->thrust_still * d->thrust_still);
  const real speed = SQRT(2 * thrust / (density * d->area));
  real a[3];
  for (int c = 0; c < 3; c++) a[c] = force[c] / thrust;
  const real along = dot(v, a, 3);
  const real q = along / speed;
  const real size = SQRT(q * q + SMALL_RATIO * SMALL_RATIO);
  const real share = d->lost * q + d->lost_squared * q * size;
  const real by_q = d->lost + d->lost_squared * (size + q * q / size);
  const real side = d->side * speed;
  real taken[3];
  real across[3];
  for (int b = 0; b < 3; b++) {
    across[b] = v[b] - along * a[b];
    taken[b] = -share * force[b] - side * across[b];
    change[b] += taken[b];
  }
  add_wrench(d->position, taken, offset);
  for (int c = 0; c < 3 && slope; c++) {
    /* d along = across_c / T, d speed = speed a_c / (2 T), d a_b = (delta_bc - a_b a_c) / T */
    const real d_along = across[c] / thrust;
    const real d_speed = speed * a[c] / (2 * thrust);
    const real d_share = by_q * (d_along - q * d_speed) / speed;
    real by[3];
    for (int b = 0; b < 3; b++) {
      const real identity = (real)(b == c);
      const real d_ahead = (identity - a[b] * a[c]) / thrust;
      const real d_across = -d_along * a[b] - along * d_ahead;
      by[b] = -d_share * force[b] - share * identity;
      by[b] -= d->side * d_speed * across[b] + side * d_across;
    }
    add_wrench(d->position, by, slope + 6 * c);
  }
}

/* Forces (n, 3) that come beside those of one robot, their wrench (6,), and its derivatives
   (n, 3, 6). */
static void offset_of(const linear_head *head, const real *force, const real *inflow, real *change,
                      real *offset, real *slope) {
  const int n = (int)head->n;
  const int size = (int)head->formula_size;
  const disc *discs = (const disc *)(head + 1);
  const real *next = (const real *)(discs + n);
  real one_change[3 * FL_MOST];
  real one_offset[6];
  real one_slope[18 * FL_MOST];
  real *one_slope_wanted = slope ? one_slope : 0;
  memset(change, 0, 3 * (size_t)n * sizeof *change);
  memset(offset, 0, 6 * sizeof *offset);
  if (slope) memset(slope, 0, 18 * (size_t)n * sizeof *slope);
  for (int i = 0; i < n && inflow; i++) {
    real *own_slope = slope ? slope + 18 * i : 0;
    add_flow(discs + i, head->density, force + 3 * i, inflow + 3 * i, change + 3 * i, offset,
             own_slope);
  }
  for (int k = 0; k < (int)head->formulas; k++) {
    const real weight = *next++;
    fl_jets(next, force, 1, 0, one_change, one_offset, one_slope_wanted);
    add_multiple(weight, one_change, 3 * n, change);
    add_multiple(weight, one_offset, 6, offset);
    if (slope) add_multiple(weight, one_slope, 18 * n, slope);
    next += size;
  }
  const fl_message_model model = {factors_of, next + (int)head->message_size};
  fl_add_messages(next, &model, force, change, offset, slope);
}

void fl_linear_interaction(const real *constants, const real *force, int count, const real *inflow,
                           real *change, real *offset, real *slope) {
  const linear_head *head = (const linear_head *)constants;
  const int n = (int)head->n;
  for (int q = 0; q < count; q++) {
    offset_of(head, force, inflow, change, offset, slope);
    force += 3 * n;
    change += 3 * n;
    offset += 6;
    if (inflow) inflow += 3 * n;
    if (slope) slope += 18 * n;
  }
}
