/* What jets take, by a model that is linear in its weights: a sum of formulas of jets, and of
   messages whose factors are polynomials of their features.

   finlab/interaction/linear.py says what the weights are, and makes the constants. */
#include "interaction_lanes.h"

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

/* Numbers of the coefficients of the polynomials of pairs' messages: interaction_kernel.h. */
enum {
  PAIR_ENTRIES = PAIR_VECTORS * PAIR_FEATURES,
  PAIR_CUBIC_ENTRIES = PAIR_VECTORS * FEATURES_OF_PLACE,
  PAIRS_OF_PLACE = FEATURES_OF_PLACE * (FEATURES_OF_PLACE + 1) / 2,
  PAIR_COEFFICIENTS = PAIR_VECTORS + PAIR_ENTRIES + PAIR_FEATURES * PAIR_ENTRIES +
      PAIRS_OF_PLACE * PAIR_CUBIC_ENTRIES
};

/* Adds what a velocity v [m/s] through the water takes of an actuator. */
static void add_flow(const disc *d, real density, const real *force, const real *v, real *change,
                     real by_own[3][3]) {
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
  real across[3];
  for (int b = 0; b < 3; b++) {
    across[b] = v[b] - along * a[b];
    change[b] -= share * force[b] + side * across[b];
  }
  for (int c = 0; c < 3; c++) {
    /* d along = across_c / T, d speed = speed a_c / (2 T), d a_b = (delta_bc - a_b a_c) / T */
    const real d_along = across[c] / thrust;
    const real d_speed = speed * a[c] / (2 * thrust);
    const real d_share = by_q * (d_along - q * d_speed) / speed;
    for (int b = 0; b < 3; b++) {
      const real identity = (real)(b == c);
      const real d_ahead = (identity - a[b] * a[c]) / thrust;
      const real d_across = -d_along * a[b] - along * d_ahead;
      by_own[c][b] -= d_share * force[b] + share * identity;
      by_own[c][b] -= d->side * d_speed * across[b] + side * d_across;
    }
  }
}

/* Whether jets are as fast by two formulas. */
static int has_one_profile(const water *one, const water *other) {
  return one->length == other->length && one->width == other->width && one->spread == other->spread;
}

/* The terms of a robot, from its numbers. */
static interaction_model model_of(const linear_head *head) {
  interaction_model model = {.formulas = (int)head->formulas};
  const real *next = (const real *)((const disc *)(head + 1) + (int)head->n);
  for (int k = 0; k < model.formulas; k++) {
    const water *w = (const water *)(next + 1);
    model.weight[k] = *next;
    model.formula[k] = w;
    next += 1 + (int)head->formula_size;
    int profile = 0;
    while (profile < model.profiles &&
           !has_one_profile(w, model.formula[model.formula_of[profile]])) {
      profile++;
    }
    if (profile == model.profiles) model.formula_of[model.profiles++] = k;
    model.profile_of[k] = profile;
  }
  model.messages = (const crowd *)next;
  model.pair_coefficients = next + (int)head->message_size;
  model.hull_coefficients = model.pair_coefficients + PAIR_COEFFICIENTS;
  return model;
}

void fl_linear_interaction(const real *constants, const real *force, int count, const real *inflow,
                           real *change, real *offset, real *slope) {
  const linear_head *head = (const linear_head *)constants;
  const disc *discs = (const disc *)(head + 1);
  const int n = (int)head->n;
  const interaction_model model = model_of(head);
  interaction_effect effect;
  for (int q = 0; q < count; q++) {
    fl_begin_effect(n, slope, &effect);
    for (int i = 0; i < n && inflow; i++) {
      add_flow(discs + i, head->density, force + 3 * i, inflow + 3 * i, effect.change[i],
               effect.by_own[i]);
    }
    fl_add_model(&model, force, &effect);
    fl_finish_effect(model.formula[0], &effect, change, offset);
    force += 3 * n;
    change += 3 * n;
    offset += 6;
    if (inflow) inflow += 3 * n;
    if (slope) slope += 18 * n;
  }
}
