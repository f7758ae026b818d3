/* What jets take, by a model that is linear in its weights: a sum of formulas of jets, and of
   messages whose factors are polynomials of their features.

   finlab/interaction/linear.py says what the weights are, and makes the constants. */
#include "internal.h"

/* The polynomials of a kind of message, factor by factor: the constant, the linear coefficients (f,)
   and a symmetric matrix (f, f), and of degree 3 a symmetric array (f, f, f) as well. */
typedef struct {
  int factors, features, degree;
} polynomial_form;

static const polynomial_form FORMS[2] = {
    [FL_PAIR_MESSAGE] = {4, 11, 2},
    [FL_HULL_MESSAGE] = {3, 7, 3},
};

/* Constants of a robot. Behind them are `formulas` times a weight and the constants of fl_jets, the
   constants of fl_jets for what speed takes, those of the messages, and the coefficients of their
   polynomials, pairs first. */
typedef struct {
  real n;
  real formulas;
  real formula_size; /* numbers of the constants of fl_jets */
  real message_size; /* numbers of the constants of the messages */
} linear_head;

static int coefficient_count(const polynomial_form *form) {
  const int f = form->features;
  int count = 1 + f + f * f;
  if (form->degree == 3) count += f * f * f;
  return count;
}

/* c + b.x + x.Ax + C[x, x, x] and its gradient b + 2 Ax + 3 C[x, x], of symmetric A and C. */
static real polynomial(const polynomial_form *form, const real *coefficients, const real *x,
                       real *gradient) {
  const int f = form->features;
  const real *linear = coefficients + 1;
  const real *quadratic = linear + f;
  const real *cubic = quadratic + f * f;
  real value = coefficients[0];
  for (int i = 0; i < f; i++) {
    const real once = dot(quadratic + i * f, x, f); /* (Ax)_i */
    real twice = 0;                                 /* C[x, x]_i */
    for (int j = 0; j < f && form->degree == 3; j++) {
      twice += x[j] * dot(cubic + (i * f + j) * f, x, f);
    }
    value += x[i] * (linear[i] + once + twice);
    if (gradient) gradient[i] = linear[i] + 2 * once + 3 * twice;
  }
  return value;
}

/* An fl_factors_of. */
static void factors_of(const real *weights, int kind, const real *features, real *factors,
                       real *jacobian) {
  const polynomial_form *form = FORMS + kind;
  const int count = coefficient_count(form);
  if (kind == FL_HULL_MESSAGE) {
    weights += FORMS[FL_PAIR_MESSAGE].factors * coefficient_count(FORMS + FL_PAIR_MESSAGE);
  }
  for (int k = 0; k < form->factors; k++) {
    real *gradient = 0;
    if (jacobian) gradient = jacobian + k * form->features;
    factors[k] = polynomial(form, weights + k * count, features, gradient);
  }
}

/* Adds a multiple of numbers to others. */
static void add_multiple(real weight, const real *numbers, int count, real *sum) {
  for (int k = 0; k < count; k++) sum[k] += weight * numbers[k];
}

/* Forces (n, 3) that come beside those of one robot, their wrench (6,), and its derivatives
   (n, 3, 6). */
static void offset_of(const linear_head *head, const real *force, const real *inflow, real *change,
                      real *offset, real *slope) {
  const int n = (int)head->n;
  const int size = (int)head->formula_size;
  const real *next = (const real *)(head + 1);
  real one_change[3 * FL_MOST];
  real one_offset[6];
  real one_slope[18 * FL_MOST];
  real *one_slope_wanted = slope ? one_slope : 0;
  memset(change, 0, 3 * (size_t)n * sizeof *change);
  memset(offset, 0, 6 * sizeof *offset);
  if (slope) memset(slope, 0, 18 * (size_t)n * sizeof *slope);
  for (int k = 0; k < (int)head->formulas + 1; k++) {
    const int is_speed = k == (int)head->formulas;
    const real weight = is_speed ? 1 : *next++;
    if (!is_speed || inflow) {
      fl_jets(next, force, 1, is_speed ? inflow : 0, one_change, one_offset, one_slope_wanted);
      add_multiple(weight, one_change, 3 * n, change);
      add_multiple(weight, one_offset, 6, offset);
      if (slope) add_multiple(weight, one_slope, 18 * n, slope);
    }
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
