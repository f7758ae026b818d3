/* Where Newton's method on the dual begins: multipliers of a target within reach, and of one at the
   rim of the attainable set. */
#include "symmetric.h"

/* Multipliers along a normal of the rim, over those at which all forces are the largest: where a
   turn of forces is measured, and the most. */
#define LARGE_T R(1e3)
#define LARGEST_T R(1e7)
/* Of a search for such multipliers: steps, and by how much each is shorter or longer. */
#define SEARCH_STEPS 10
#define SEARCH_FACTOR 4

/* An actuator as a quadratic cost sees it. */
typedef struct {
  real secant[2]; /* force over price of each row at its largest force [N^2/W] */
  real most;      /* largest force [N] */
} quadratic_cost;

/* The table of force over price by which an actuator answers a price of this sign. */
static const real *table_for(const real *block, const fl_actuator *a, real price) {
  if (price < 0 && a->force_table_reverse > 0) return block + (int)a->force_table_reverse;
  return block + (int)a->force_table;
}

/* The quadratic cost of an actuator at prices of a sign: of a line by its table for that sign. */
static quadratic_cost quadratic_of(const real *block, const fl_actuator *a, real price) {
  quadratic_cost cost = {{a->secant[0], a->secant[1]}, a->row_force_max[0]};
  if (a->rows == 1) {
    const real *table = table_for(block, a, price);
    const real price_max = table[0];
    const int cells = (int)table[1];
    const real force_max = table[3 + 3 * cells];
    cost.most = a->force_scale * force_max;
    cost.secant[0] = cost.most * a->force_scale / (price_max * a->power_scale);
  }
  return cost;
}

/* Force over price at a share of the largest force, over the secant of that [1]. Where the cost is
   ~ T^1.5, as of all laws nearly, it is the root of the share; the table of a line whose cost is
   another one says it. Where foils drag their kinks decide of the steps. */
static real secant_at(const real *block, const fl_work *work, int i, real price, real share,
                      const quadratic_cost *cost) {
  const fl_actuator *a = ACTUATOR(block, i);
  const int has_cells = table_for(block, a, price)[1] > 1;
  if (a->rows != 1 || !has_cells || work->has_drag) return SQRT(share);
  const real size = share * cost->most;
  real force = size;
  if (price < 0) force = -size;
  real price_of_force;
  fl_power_and_price(block, i, force, &price_of_force);
  return size / larger(price_of_force * cost->secant[0], TINY);
}

/* Adds to H the forces over prices that an actuator has at the force that it gives to multipliers
   where costs are quadratic. Returns that force over its largest one. */
static real add_secants(const real *block, const fl_work *work, int i, const real *lambda_quadratic,
                        symmetric *H) {
  const fl_actuator *a = ACTUATOR(block, i);
  real s[2];
  actuator_price(work, i, lambda_quadratic, s);
  real size_s = FABS(s[0]); /* of a foil its lift alone counts */
  if (is_plane(a)) size_s = size_of(s);
  const real size_y = a->secant[0] * size_s;
  const quadratic_cost cost = quadratic_of(block, a, s[0]);
  const real share = size_y / cost.most;
  real weight = secant_at(block, work, i, s[0], clipped(share, CLOSE, 1), &cost);
  if (share > 1 && !work->has_drag) weight = 1 / share; /* at a limit the force stays */
  for (int row = 0; row < (int)a->rows; row++) {
    add_square(H, work->span.effectiveness_reduced[i][row], weight * cost.secant[row]);
  }
  return share;
}

/* Solves H lambda = target, H made regular by a share of its trace. */
static void solve_regular(symmetric *H, real ridge_share, const real *target_reduced,
                          real *lambda) {
  const real trace = trace_of(H);
  if (!(trace > 0)) { /* nobody pushes, such as lost actuators: any multipliers are as good */
    memset(lambda, 0, 6 * sizeof *lambda);
    return;
  }
  add_to_diagonal(H, ridge_share * trace);
  if (solve_symmetric(H, target_reduced, lambda)) return;
  for (int j = 0; j < 6; j++) lambda[j] = target_reduced[j] / trace;
}

/* Multipliers to begin with: those at which actuators give a target, each with its force over price
   at what it gives where costs are quadratic. Also the first mu. */
void fl_first_lambda(const real *block, const fl_work *work, const real *target_reduced,
                     real *lambda, real *mu) {
  /* Multipliers of quadratic costs without limits. C99 cannot pass the factor as const; it
     is only read. */
  real lambda_quadratic[6];
  fl_solve((real(*)[6])work->hessian_factor, target_reduced, lambda_quadratic);
  symmetric H = no_matrix();
  *mu = NEARLY;
  for (int i = 0; i < COUNT(block); i++) {
    const real share = add_secants(block, work, i, lambda_quadratic, &H);
    if (share > NEAR_LIMIT) *mu = MU_NEAR_LIMIT;
  }
  solve_regular(&H, NOTHING, target_reduced, lambda); /* regular behind the range, too */
  if (fl_is_drag_welcome(block, work, lambda)) *mu = MU_NEAR_LIMIT;
}

/* Price [W/N] from which on an actuator gives its largest force. */
static real price_of_largest_force(const real *block, const fl_actuator *a, real price) {
  const real price_max = table_for(block, a, price)[0];
  return price_max * a->power_scale / a->force_scale;
}

/* What the rim of the attainable set with an outer normal n asks of each actuator: those that n has
   a price for give the farthest force along n. The others, whose price is 0, give what is left. */
typedef struct {
  int is_other[FL_MOST];
  int others; /* how many there are */
  real t;     /* times n, at which no farthest force is less than its largest [1/N^2] */
} rim_actuators;

static void find_rim_actuators(const real *block, const fl_work *work, const real *normal,
                               rim_actuators *rim) {
  real worth[FL_MOST]; /* of the largest force along the normal */
  real most_worth = 0;
  for (int i = 0; i < COUNT(block); i++) {
    real s[2];
    actuator_price(work, i, normal, s);
    worth[i] = size_of(s) * ACTUATOR(block, i)->row_force_max[0];
    most_worth = larger(most_worth, worth[i]);
  }
  rim->t = 0;
  rim->others = 0;
  for (int i = 0; i < COUNT(block); i++) {
    rim->is_other[i] = !(worth[i] > NEARLY * most_worth);
    rim->others += rim->is_other[i];
    if (rim->is_other[i]) continue;
    const fl_actuator *a = ACTUATOR(block, i);
    real s[2];
    actuator_price(work, i, normal, s);
    rim->t = larger(rim->t, price_of_largest_force(block, a, s[0]) / larger(size_of(s), TINY));
  }
}

/* Multipliers nu at which the others give a residual, as those of fl_first_lambda do. */
static void multipliers_of_others(const real *block, const fl_work *work, const rim_actuators *rim,
                                  const real *residual, real *nu) {
  symmetric H = no_matrix();
  symmetric H_quadratic = no_matrix();
  real nu_quadratic[6];
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    for (int row = 0; row < (int)a->rows && rim->is_other[i]; row++) {
      add_square(&H_quadratic, work->span.effectiveness_reduced[i][row], a->secant[row]);
    }
  }
  solve_regular(&H_quadratic, NEARLY, residual, nu_quadratic);
  for (int i = 0; i < COUNT(block); i++) {
    if (rim->is_other[i]) add_secants(block, work, i, nu_quadratic, &H);
  }
  solve_regular(&H, NEARLY, residual, nu);
}

/* What the forces at t n + nu give less along n than the farthest ones: their residual along n, and
   what the target does, `inside`. */
static real lost_along(const real *block, fl_work *work, const real *target_reduced,
                       const real *normal, const real *nu, real t, real inside) {
  real lambda[6];
  for (int j = 0; j < 6; j++) lambda[j] = t * normal[j] + nu[j];
  fl_dual_start(block, work, target_reduced, lambda);
  return dot(normal, work->state_found->residual, 6) + inside;
}

/* Multipliers to begin with at a target at the rim of the attainable set, or next to it: t n + nu,
   where n is the outer normal of the rim, in the basis. The others have the price of nu alone. It
   turns the farthest forces of planes, too, by nu / t, which then give less along n, by its square:
   so t is as large as leaves the target within reach. For a target further inside, t is a little
   less than makes all forces the largest, as their derivatives are 0 from there on. */
void fl_first_lambda_at_rim(const real *block, fl_work *work, const real *target_reduced,
                            const real *normal, real *lambda) {
  rim_actuators rim;
  find_rim_actuators(block, work, normal, &rim);
  const real t_large = LARGE_T * rim.t;
  for (int j = 0; j < 6; j++) lambda[j] = t_large * normal[j];
  fl_dual_start(block, work, target_reduced, lambda);
  const fl_state *state = work->state_found;
  const real to_target = dot(normal, state->residual, 6); /* below 0 where it is inside */
  const real least = TOLERANCE / 2 * SQRT(dot(normal, normal, 6));
  real t = (1 - NEARLY) * rim.t;
  real nu[6] = {0};
  const int is_box = fl_has_lines_alone(block); /* no force turns */
  if (rim.others > 0) {
    multipliers_of_others(block, work, &rim, state->residual, nu);
  }
  if (rim.others > 0 && !is_box) {
    for (int j = 0; j < 6; j++) lambda[j] += nu[j];
    fl_dual_start(block, work, target_reduced, lambda);
    const real lost = dot(normal, state->residual, 6) - to_target; /* along n, by the turn */
    const real may_lose = larger(-to_target, least);
    if (lost > 0) t = clipped(t_large * SQRT(lost / may_lose), t, LARGEST_T * t);
  }
  /* The last share of a force may have a price without end. */
  for (int k = 0; k < SEARCH_STEPS && !is_box; k++) {
    const real shorter = t / SEARCH_FACTOR;
    const real lost = lost_along(block, work, target_reduced, normal, nu, shorter, -to_target);
    if (lost > least) break;
    t = shorter;
  }
  for (int j = 0; j < 6; j++) lambda[j] = t * normal[j] + nu[j];
}

/* Multipliers to begin with at a target that lies so far `inside` of the rim along its normal n, of
   those of a target at the rim, which become them: t n + nu with a smaller t. What forces lose
   along n by nu grows about as 1 / t^2, by those that are no longer the largest it grows faster: t
   is looked for at which they lose about as much as the target does. */
void fl_first_lambda_inside(const real *block, fl_work *work, const real *target_reduced,
                            const real *normal, real inside, real *lambda) {
  const real squared = dot(normal, normal, 6);
  const real t_rim = dot(normal, lambda, 6) / larger(squared, TINY);
  if (!(t_rim > 0 && inside > 0)) return;
  real nu[6];
  for (int j = 0; j < 6; j++) nu[j] = lambda[j] - t_rim * normal[j];
  real lost = lost_along(block, work, target_reduced, normal, nu, t_rim, inside);
  real high = t_rim; /* where they lose less than the target */
  real low = 0;      /* where they lose more */
  real t = t_rim / SEARCH_FACTOR;
  if (lost > 0 && lost < inside) t = smaller(t, t_rim * SQRT(lost / inside));
  for (int k = 0; k < SEARCH_STEPS; k++) {
    lost = lost_along(block, work, target_reduced, normal, nu, t, inside);
    const real most = SEARCH_FACTOR * inside;
    if (lost > most) {
      low = t;
    } else if (lost < inside / SEARCH_FACTOR) {
      high = t;
    } else {
      break;
    }
    t = high / SEARCH_FACTOR;
    if (low > 0) t = SQRT(low * high);
  }
  for (int j = 0; j < 6; j++) lambda[j] = t * normal[j] + nu[j];
}
