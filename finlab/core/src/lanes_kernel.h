/* Newton's method on the dual and commands for its forces, for LANES targets at once: the formulas
   of dual_newton.c, actuator_response.c, command_law.c and command_refine.c, in vectors. Included
   by a file for each width of vectors, which defines `select_lanes`, `root_of`, `larger_of`,
   `smaller_of` and `bits_of`.

   A lane whose target is met, or is left to fl_answer_one, takes up the next one: so targets that
   take few steps wait for none that takes many. No number goes from one lane to another. */

#define CHUNK 64        /* targets that are on the stack at once */
#define PRICE_STEPS 5   /* of Newton's method to a price of first multipliers */
#define LANES_STEPS 100 /* steps of Newton's method in a lane; what takes more is left */
/* Wrench [N, N m], and multiplier to begin with [W/N, W/(N m)]; larger ones are left. */
#define LARGEST_IN_LANES R(1e9)
#define SLIGHT R(1e-3) /* turn [rad] up to which its sine and cosine are those of their series */

/* A target on its way through the lanes. */
typedef struct {
  real target[6]; /* scaled wrench in the basis */
  real lambda[6]; /* multipliers to begin with, then those it comes to [W] */
  real mu;        /* first damping */
  int is_met;
} candidate;

/* The dual at multipliers, as in fl_state. */
typedef struct {
  vector lambda[6];
  vector residual[6];
  vector force[FL_MOST][2];
  vector dy_ds[FL_MOST][3];
  vector secant[FL_MOST];
  vector dual_value;
  vector residual_size;
} lanes_state;

typedef struct {
  vector force, slope, conjugate;
} lanes_line;

static inline mask no_lanes(void) { return (mask){0}; }

static inline vector clipped_lanes(vector x, vector low, vector high) {
  return smaller_of(larger_of(x, low), high);
}

static inline vector size_of_lanes(vector x) { return larger_of(x, -x); }

static inline vector floor_of(vector x) {
  const vector nearest = (x + ROUNDER) - ROUNDER;
  return select_lanes(nearest > x, nearest - 1, nearest);
}

/* Integers from 0 on, given as numbers, as integers. */
static inline mask integer_of(vector x) { return (mask)(x + ROUNDER) - (mask)lanes_of(ROUNDER); }

static inline vector fourth_power_of(vector x) {
  const vector squared = x * x;
  return squared * squared;
}

static inline vector dot_lanes(const vector *a, const vector *b) {
  vector sum = a[0] * b[0];
  for (int j = 1; j < 6; j++) sum += a[j] * b[j];
  return sum;
}

static inline vector dot_column(const real *column, const vector *x) {
  vector sum = column[0] * x[0];
  for (int j = 1; j < 6; j++) sum += column[j] * x[j];
  return sum;
}

/* A cubic between two knots: value + t (m0 + t (b + t c)), t from 0 to 1, as in force_table.c. */
typedef struct {
  vector value, m0, b, c;
} lanes_cubic;

static inline lanes_cubic cubic_in_lanes(vector first, vector last, vector m0, vector m1) {
  const vector rise = last - first;
  const lanes_cubic cubic = {first, m0, 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise};
  return cubic;
}

static inline vector value_in_lanes(const lanes_cubic *p, vector t) {
  return p->value + t * (p->m0 + t * (p->b + t * p->c));
}

static inline vector slope_in_lanes(const lanes_cubic *p, vector t) {
  return p->m0 + t * (2 * p->b + 3 * t * p->c);
}

/* Force T(v), its derivative and the conjugate at prices v from 0 on, Eq. 5, of the table ahead or
   that in reverse: fl_force_of_price. */
static inline lanes_line table_at(const lanes_robot *robot, const lanes_actuator *a,
                                  mask is_reverse, vector price) {
  const fl_price_table *ahead = &a->table[0];
  const fl_price_table *back = &a->table[1];
  vector price_max = lanes_of(ahead->price_max);
  vector dt_dv = lanes_of(ahead->over_price);
  vector force_max = lanes_of(ahead->force_max);
  vector conjugate_max = lanes_of(ahead->conjugate_max);
  vector knot[5]; /* force, slope and conjugate at the cell's begin, force and slope at its end */
  price = larger_of(price, lanes_of(0));
  if (a->has_reverse) {
    price_max = select_lanes(is_reverse, lanes_of(back->price_max), price_max);
    dt_dv = select_lanes(is_reverse, lanes_of(back->over_price), dt_dv);
    force_max = select_lanes(is_reverse, lanes_of(back->force_max), force_max);
    conjugate_max = select_lanes(is_reverse, lanes_of(back->conjugate_max), conjugate_max);
  }
  vector t = price * dt_dv; /* place in the cell, from 0 to 1 */
  vector scale = price_max; /* price of the width of a cell */
  if (a->is_one_cell) {
    for (int k = 0; k < 5; k++) {
      knot[k] = lanes_of(robot->block[ahead->offset + k]);
      if (!a->has_reverse) continue;
      knot[k] = select_lanes(is_reverse, lanes_of(robot->block[back->offset + k]), knot[k]);
    }
  } else {
    vector cells = lanes_of(ahead->cells);
    vector each = lanes_of(ahead->each);
    vector offset = lanes_of((real)ahead->offset);
    if (a->has_reverse) {
      cells = select_lanes(is_reverse, lanes_of(back->cells), cells);
      each = select_lanes(is_reverse, lanes_of(back->each), each);
      offset = select_lanes(is_reverse, lanes_of((real)back->offset), offset);
    }
    const vector cell = floor_of(smaller_of(root_of(root_of(t)) * cells, cells - 1));
    const vector begin = fourth_power_of(cell * each);
    const vector width = fourth_power_of((cell + 1) * each) - begin;
    const vector over = 1 / width;
    t = (t - begin) * over;
    dt_dv *= over;
    scale *= width;
    const mask index = integer_of(offset + 3 * cell);
    gather_four(robot->block, index, knot);
    knot[4] = gather(robot->block + 4, index);
  }
  const lanes_cubic force = cubic_in_lanes(knot[0], knot[3], knot[1] * scale, knot[4] * scale);
  const vector third = lanes_of(R(1.0) / 3);
  const vector integral = knot[0] +
                          t * (force.m0 * R(0.5) + t * (force.b * third + t * force.c * R(0.25)));
  lanes_line line;
  line.force = value_in_lanes(&force, t);
  line.slope = slope_in_lanes(&force, t) * dt_dv;
  line.conjugate = knot[2] + scale * t * integral;
  const mask is_within = price < price_max;
  const vector conjugate_beyond = conjugate_max + (price - price_max) * force_max;
  line.force = select_lanes(is_within, line.force, force_max);
  line.slope = select_lanes(is_within, line.slope, lanes_of(0));
  line.conjugate = select_lanes(is_within, line.conjugate, conjugate_beyond);
  return line;
}

/* The response between the limits of a set to a price along it, Eq. 5: fl_limited_response. */
static inline lanes_line limited_response(const lanes_robot *robot, const lanes_actuator *a,
                                          int is_line, vector price) {
  mask is_reverse = no_lanes();
  vector v = price;
  if (is_line) {
    is_reverse = price < 0;
    v = size_of_lanes(price);
  }
  lanes_line y = table_at(robot, a, is_reverse, v * a->price_ratio);
  y.force *= a->force_scale;
  y.slope *= a->force_scale * a->price_ratio;
  y.conjugate *= a->power_scale;
  if (is_line) y.force = select_lanes(is_reverse, -y.force, y.force);
  if (!is_line && a->has_arc) y.slope = select_lanes(v > 0, y.slope, lanes_of(0));

  const mask is_low = y.force <= a->force_min;
  const mask is_high = y.force >= a->force_max;
  const mask is_limited = is_low | is_high;
  vector limit = lanes_of(a->force_max);
  vector cost = lanes_of(a->cost_at_max);
  limit = select_lanes(is_low, lanes_of(a->force_min), limit);
  cost = select_lanes(is_low, lanes_of(a->cost_at_min), cost);
  y.force = select_lanes(is_limited, limit, y.force);
  y.slope = select_lanes(is_limited, lanes_of(0), y.slope);
  y.conjugate = select_lanes(is_limited, price * limit - cost, y.conjugate);
  return y;
}

/* A response in a plane: force, its derivatives by the price xx, xy, yy, and the conjugate. */
typedef struct {
  vector x, y, xx, xy, yy, conjugate;
  vector size;       /* of the force */
  vector price_size; /* of the price */
} lanes_response;

/* The response T along an end of an arc, a direction (x, y) that no price turns. */
static inline lanes_response response_at_end(const lanes_robot *robot, const lanes_actuator *a,
                                             vector x, vector y, const vector *price) {
  const lanes_line T = limited_response(robot, a, 0, price[0] * x + price[1] * y);
  lanes_response answer;
  answer.x = T.force * x;
  answer.y = T.force * y;
  answer.xx = T.slope * x * x;
  answer.xy = T.slope * x * y;
  answer.yy = T.slope * y * y;
  answer.conjugate = T.conjugate;
  return answer;
}

/* The smooth maximum of two conjugates, Eqs. 25 to 27. */
static inline lanes_response blended(const lanes_response *one, const lanes_response *other,
                                     real omega) {
  const vector delta = one->conjugate - other->conjugate;
  const vector root = root_of(delta * delta + omega * omega);
  const vector p = (1 + delta / root) / 2;
  const vector q = 1 - p;
  const vector dp = omega * omega / (2 * root * root * root);
  const vector dx = one->x - other->x;
  const vector dy = one->y - other->y;
  lanes_response blend;
  blend.x = p * one->x + q * other->x;
  blend.y = p * one->y + q * other->y;
  blend.xx = p * one->xx + q * other->xx + dp * dx * dx;
  blend.xy = p * one->xy + q * other->xy + dp * dx * dy;
  blend.yy = p * one->yy + q * other->yy + dp * dy * dy;
  blend.conjugate = one->conjugate + (root - delta) / 2;
  return blend;
}

static inline lanes_response select_response(mask m, const lanes_response *yes,
                                             const lanes_response *no) {
  lanes_response chosen;
  chosen.x = select_lanes(m, yes->x, no->x);
  chosen.y = select_lanes(m, yes->y, no->y);
  chosen.xx = select_lanes(m, yes->xx, no->xx);
  chosen.xy = select_lanes(m, yes->xy, no->xy);
  chosen.yy = select_lanes(m, yes->yy, no->yy);
  chosen.conjugate = select_lanes(m, yes->conjugate, no->conjugate);
  return chosen;
}

/* The response of a plane that pushes one way, without a gauge: sector_response of
   actuator_response.c. */
static inline lanes_response plane_response(const lanes_robot *robot, const lanes_actuator *a,
                                            const vector *price) {
  const vector size = root_of(price[0] * price[0] + price[1] * price[1] + a->price_floor_squared);
  const vector inverse = 1 / size;
  const vector x = price[0] * inverse;
  const vector y = price[1] * inverse;
  vector gx = x; /* direction g of the force */
  vector gy = y;
  vector v = size;
  vector turning = inverse;
  mask is_beyond = no_lanes();
  mask is_first = no_lanes(); /* whether the end of smaller angles is the nearer one */
  if (a->has_arc) {
    const vector along = x * a->center[0] + y * a->center[1];
    const vector across = y * a->center[0] - x * a->center[1];
    is_beyond = size_of_lanes(across) * a->half[0] > along * a->half[1];
    is_first = across < 0;
    const vector end_x = select_lanes(is_first, lanes_of(a->end[0][0]), lanes_of(a->end[1][0]));
    const vector end_y = select_lanes(is_first, lanes_of(a->end[0][1]), lanes_of(a->end[1][1]));
    gx = select_lanes(is_beyond, end_x, x);
    gy = select_lanes(is_beyond, end_y, y);
    v = select_lanes(is_beyond, price[0] * end_x + price[1] * end_y, v);
    turning = select_lanes(is_beyond, lanes_of(0), turning);
  }
  const lanes_line T = limited_response(robot, a, 0, v);
  lanes_response own;
  own.x = T.force * gx;
  own.y = T.force * gy;
  own.xx = T.slope * gx * gx + T.force * turning * (1 - x * x);
  own.xy = T.slope * gx * gy - T.force * turning * x * y;
  own.yy = T.slope * gy * gy + T.force * turning * (1 - y * y);
  own.conjugate = T.conjugate;
  own.size = size_of_lanes(T.force);
  own.price_size = size;
  if (!a->is_forked || !bits_of(is_beyond)) return own;
  const vector other_x = select_lanes(is_first, lanes_of(a->end[1][0]), lanes_of(a->end[0][0]));
  const vector other_y = select_lanes(is_first, lanes_of(a->end[1][1]), lanes_of(a->end[0][1]));
  const lanes_response other = response_at_end(robot, a, other_x, other_y, price);
  const lanes_response blend = blended(&own, &other, a->blend_width);
  lanes_response chosen = select_response(is_beyond, &blend, &own);
  const vector size_of_blend = root_of(blend.x * blend.x + blend.y * blend.y);
  chosen.size = select_lanes(is_beyond, size_of_blend, own.size);
  chosen.price_size = size;
  return chosen;
}

/* Evaluates the dual at the multipliers of `to`, for targets in the basis: fl_dual_at. */
static void evaluate(const lanes_robot *robot, const vector *target, lanes_state *to) {
  const vector *lambda = to->lambda;
  vector wrench[6] = {{0}}; /* sum B y */
  vector conjugate = {0};   /* sum c*(s) */
  for (int i = 0; i < robot->n; i++) {
    const lanes_actuator *a = &robot->actuator[i];
    const real(*B)[6] = a->column;
    vector s[2];
    vector size_s;
    vector size_y;
    s[0] = dot_column(B[0], lambda);
    if (a->is_plane) {
      s[1] = dot_column(B[1], lambda);
      const lanes_response y = plane_response(robot, a, s);
      to->force[i][0] = y.x;
      to->force[i][1] = y.y;
      to->dy_ds[i][0] = y.xx;
      to->dy_ds[i][1] = y.xy;
      to->dy_ds[i][2] = y.yy;
      conjugate += y.conjugate;
      size_s = y.price_size;
      size_y = y.size;
      for (int j = 0; j < 6; j++) wrench[j] += y.x * B[0][j] + y.y * B[1][j];
    } else {
      const lanes_line y = limited_response(robot, a, 1, s[0]);
      to->force[i][0] = y.force;
      to->dy_ds[i][0] = y.slope;
      conjugate += y.conjugate;
      size_s = size_of_lanes(s[0]);
      size_y = size_of_lanes(y.force);
      for (int j = 0; j < 6; j++) wrench[j] += y.force * B[0][j];
    }
    to->secant[i] = size_y / larger_of(size_s, lanes_of(a->price_quadratic)); /* Eq. 9 */
  }
  for (int j = 0; j < 6; j++) to->residual[j] = target[j] - wrench[j]; /* Eq. 6 */
  to->dual_value = dot_lanes(lambda, target) - conjugate;              /* Eq. 3 */
  to->residual_size = root_of(dot_lanes(to->residual, to->residual));
}

/* Turns the lower triangle of A into L and 1 / D of A = L D L'; returns where A is singular to
   rounding. */
static inline mask factor_lanes(vector A[6][6]) {
  mask is_singular = no_lanes();
  for (int i = 0; i < 6; i++) {
    vector LD[6]; /* row i of L D */
    vector pivot = A[i][i];
    for (int j = 0; j < i; j++) {
      LD[j] = A[i][j];
      for (int k = 0; k < j; k++) LD[j] -= LD[k] * A[j][k];
    }
    for (int j = 0; j < i; j++) {
      A[i][j] = LD[j] * A[j][j];
      pivot -= LD[j] * A[i][j];
    }
    is_singular |= ~(pivot > 0);
    A[i][i] = 1 / pivot;
  }
  return is_singular;
}

/* Solves L D L' x = right for a factor of factor_lanes. */
static inline void solve_lanes(vector factor[6][6], const vector *right, vector *x) {
  for (int i = 0; i < 6; i++) {
    x[i] = right[i];
    for (int k = 0; k < i; k++) x[i] -= factor[i][k] * x[k];
  }
  for (int i = 5; i >= 0; i--) {
    x[i] *= factor[i][i];
    for (int k = 5; k > i; k--) x[i] -= factor[k][i] * x[k];
  }
}

/* Solves the same for one factor of all lanes. */
static inline void solve_alike(const real factor[6][6], const vector *right, vector *x) {
  vector same[6][6];
  for (int i = 0; i < 6; i++) {
    for (int k = 0; k <= i; k++) same[i][k] = lanes_of(factor[i][k]);
  }
  solve_lanes(same, right, x);
}

static inline vector trace_of(vector H[6][6]) {
  vector sum = H[0][0];
  for (int k = 1; k < 6; k++) sum += H[k][k];
  return sum;
}

/* A row of G_mu = G + mu S, up to the diagonal. */
static inline __attribute__((always_inline)) void hessian_row(const lanes_robot *robot,
                                                              const lanes_state *at, vector mu,
                                                              int row, vector H[6][6]) {
  vector sum[6] = {{0}};
  for (int i = 0; i < robot->n; i++) {
    const lanes_actuator *a = &robot->actuator[i];
    const real(*B)[6] = a->column;
    const vector xx = at->dy_ds[i][0] + mu * at->secant[i];
    if (a->is_plane) {
      const vector xy = at->dy_ds[i][1];
      const vector yy = at->dy_ds[i][2] + mu * at->secant[i];
      const vector DBx = xx * B[0][row] + xy * B[1][row];
      const vector DBy = xy * B[0][row] + yy * B[1][row];
      for (int col = 0; col <= row; col++) sum[col] += DBx * B[0][col] + DBy * B[1][col];
    } else {
      const vector DB = xx * B[0][row];
      for (int col = 0; col <= row; col++) sum[col] += DB * B[0][col];
    }
  }
  for (int col = 0; col <= row; col++) H[row][col] = sum[col];
}

/* Solves (G_mu + mu c max(tr G_mu, tau) M) step = r, Eq. 8; returns where that is singular to
   rounding. Also max(tr G_mu, tau). */
static mask newton_step_lanes(const lanes_robot *robot, const lanes_state *at, vector mu,
                              vector *step, vector *trace) {
  const fl_work *work = robot->work;
  vector H[6][6];
  hessian_row(robot, at, mu, 0, H);
  hessian_row(robot, at, mu, 1, H);
  hessian_row(robot, at, mu, 2, H);
  hessian_row(robot, at, mu, 3, H);
  hessian_row(robot, at, mu, 4, H);
  hessian_row(robot, at, mu, 5, H);
  *trace = larger_of(trace_of(H), lanes_of(work->trace_min));
  const vector weight = SATURATED * mu * *trace; /* of M */
  for (int row = 0; row < 6; row++) {
    for (int col = 0; col <= row; col++) H[row][col] += weight * work->metric[row][col];
  }
  const mask is_singular = factor_lanes(H);
  solve_lanes(H, at->residual, step);
  return is_singular;
}

/* d'(S + c max(tr G_mu, tau) M) d of a step d, the damping along it. */
static vector damping_along_lanes(const lanes_robot *robot, const lanes_state *at, vector trace,
                                  const vector *step) {
  const fl_work *work = robot->work;
  vector sum = lanes_of(0);
  for (int i = 0; i < robot->n; i++) {
    const lanes_actuator *a = &robot->actuator[i];
    vector s = dot_column(a->column[0], step);
    vector squared = s * s;
    if (a->is_plane) {
      s = dot_column(a->column[1], step);
      squared += s * s;
    }
    sum += at->secant[i] * squared;
  }
  vector of_metric = lanes_of(0);
  for (int row = 0; row < 6; row++) {
    of_metric += work->metric[row][row] * step[row] * step[row];
    for (int col = 0; col < row; col++) {
      of_metric += 2 * work->metric[row][col] * step[row] * step[col];
    }
  }
  return sum + SATURATED * trace * of_metric;
}

/* Price at which a line gives a size of force by its table ahead or that in reverse, as
   fl_marginal_cost finds it: the cell by halving, and the place in it by Newton's method. */
static vector price_of_force(const lanes_robot *robot, const lanes_actuator *a, mask is_reverse,
                             vector size) {
  const real *block = robot->block;
  const fl_price_table *ahead = &a->table[0];
  const fl_price_table *back = &a->table[1];
  const vector cells = select_lanes(is_reverse, lanes_of(back->cells), lanes_of(ahead->cells));
  const vector each = select_lanes(is_reverse, lanes_of(back->each), lanes_of(ahead->each));
  const vector price_max =
      select_lanes(is_reverse, lanes_of(back->price_max), lanes_of(ahead->price_max));
  const vector offset =
      select_lanes(is_reverse, lanes_of((real)back->offset), lanes_of((real)ahead->offset));
  vector low = lanes_of(0);
  vector high = cells;
  while (bits_of(high - low > 1)) {
    const vector between = floor_of((low + high) / 2);
    const vector force = gather(block, integer_of(offset + 3 * between));
    const mask is_open = high - low > 1;
    const mask is_below = force < size;
    low = select_lanes(is_open & is_below, between, low);
    high = select_lanes(is_open & ~is_below, between, high);
  }
  const vector begin = fourth_power_of(low * each);
  const vector scale = (fourth_power_of((low + 1) * each) - begin) * price_max;
  const mask index = integer_of(offset + 3 * low);
  vector knot[4];
  gather_four(block, index, knot);
  const lanes_cubic force =
      cubic_in_lanes(knot[0], knot[3], knot[1] * scale, gather(block + 4, index) * scale);
  vector t = (size - force.value) / (knot[3] - knot[0]);
  t = clipped_lanes(select_lanes(low == 0, root_of(t), t), lanes_of(0), lanes_of(1));
  for (int k = 0; k < PRICE_STEPS; k++) {
    const vector next = t - (value_in_lanes(&force, t) - size) / slope_in_lanes(&force, t);
    t = clipped_lanes(select_lanes(slope_in_lanes(&force, t) > 0, next, t), lanes_of(0),
                      lanes_of(1));
  }
  return begin * price_max + scale * t;
}

/* Force over price of a line at a share of its largest force, over the secant of that [1]:
   secant_at of first_multipliers.c. */
static inline vector secant_of_line(const lanes_robot *robot, const lanes_actuator *a,
                                    mask is_reverse, vector share, vector most, vector secant) {
  if (a->is_one_cell) return root_of(share);
  const vector size = share * most;
  const vector price = price_of_force(robot, a, is_reverse, size / a->force_scale);
  return size * a->price_ratio / larger_of(price * secant, lanes_of(TINY));
}

/* Multipliers to begin with, and the first mu: fl_first_lambda. */
static inline void first_lambda_lanes(const lanes_robot *robot, const vector *target,
                                      vector *lambda, vector *mu) {
  vector lambda_quadratic[6];
  vector H[6][6];
  solve_alike((const real(*)[6])robot->work->hessian_factor, target, lambda_quadratic);
  for (int row = 0; row < 6; row++) {
    for (int col = 0; col <= row; col++) H[row][col] = lanes_of(0);
  }
  mask is_near_limit = no_lanes();
  for (int i = 0; i < robot->n; i++) {
    const lanes_actuator *a = &robot->actuator[i];
    const real(*B)[6] = a->column;
    vector size_s = dot_column(B[0], lambda_quadratic);
    vector most = lanes_of(a->most[0]);
    vector secant = lanes_of(a->secant_at_most[0]);
    mask is_reverse = no_lanes();
    if (a->is_plane) {
      const vector s1 = dot_column(B[1], lambda_quadratic);
      size_s = root_of(size_s * size_s + s1 * s1);
    } else {
      is_reverse = size_s < 0;
      most = select_lanes(is_reverse, lanes_of(a->most[1]), most);
      secant = select_lanes(is_reverse, lanes_of(a->secant_at_most[1]), secant);
      size_s = size_of_lanes(size_s);
    }
    const vector share = a->secant_quadratic * size_s / most;
    const vector held_share = clipped_lanes(share, lanes_of(CLOSE), lanes_of(1));
    is_near_limit |= share > NEAR_LIMIT;
    vector weight;
    if (a->is_plane) {
      weight = root_of(held_share);
    } else {
      weight = secant_of_line(robot, a, is_reverse, held_share, most, secant);
    }
    weight = select_lanes(share > 1, 1 / share, weight);
    for (int line = 0; line < 1 + a->is_plane; line++) {
      if (line == 1) secant = lanes_of(a->secant_at_most[1]);
      for (int row = 0; row < 6; row++) {
        const vector scaled = weight * secant * B[line][row];
        for (int col = 0; col <= row; col++) H[row][col] += scaled * B[line][col];
      }
    }
  }
  const vector trace = trace_of(H);
  for (int j = 0; j < 6; j++) H[j][j] += NOTHING * trace;
  const mask is_singular = factor_lanes(H);
  solve_lanes(H, target, lambda);
  for (int j = 0; j < 6; j++) lambda[j] = select_lanes(is_singular, target[j] / trace, lambda[j]);
  *mu = select_lanes(is_near_limit, lanes_of(MU_NEAR_LIMIT), lanes_of(NEARLY));
}

/* Multipliers in the basis [W] of those of the wrench (count, 6): fl_reduce_lambda. Returns where
   they can be begun with: not where they are NaN. */
static inline mask reduce_lambda_lanes(const fl_span *span, const real *multipliers, int count,
                                       vector *lambda) {
  mask is_small = ~no_lanes();
  for (int j = 0; j < 6; j++) lambda[j] = lanes_of(0);
  for (int k = 0; k < 6; k++) {
    vector own = {0};
    for (int l = 0; l < LANES; l++) own[l] = multipliers[6 * (l < count ? l : count - 1) + k];
    is_small &= size_of_lanes(own) <= LARGEST_IN_LANES;
    own *= span->axis_scale[k];
    for (int j = 0; j < 6; j++) lambda[j] += span->basis[k][j] * own;
  }
  return is_small;
}

/* Sets up to LANES candidates of a chunk: their targets and where they begin, at multipliers
   (count, 6), or at their own where there are none. Returns a bit for each that lies in the range
   of the effectiveness, and is a wrench that can be answered. */
static int begin_lanes(const lanes_robot *robot, const real *wrench, const real *multipliers,
                       int count, candidate *candidates) {
  const fl_span *span = &robot->work->span;
  vector scaled[6];
  vector target[6];
  vector lambda[6];
  vector mu;
  vector outside_squared = {0};
  vector size_squared = {0};
  mask is_small = ~no_lanes();
  for (int k = 0; k < 6; k++) {
    vector w = {0};
    for (int l = 0; l < LANES; l++) w[l] = wrench[6 * (l < count ? l : count - 1) + k];
    is_small &= size_of_lanes(w) <= LARGEST_IN_LANES;
    if (!span->axis_counts[k]) w = lanes_of(0);
    scaled[k] = (w - span->wrench_offset[k]) / span->axis_scale[k];
  }
  for (int j = 0; j < 6; j++) {
    target[j] = lanes_of(0);
    for (int k = 0; k < 6; k++) target[j] += span->basis[k][j] * scaled[k];
  }
  for (int k = 0; k < 6; k++) {
    const vector outside = scaled[k] - dot_column(span->basis[k], target);
    outside_squared += outside * outside;
    size_squared += scaled[k] * scaled[k];
  }
  const real rounding = larger(NEARLY, 10 * ROUNDING);
  const mask is_in_range = root_of(outside_squared) <=
                           rounding * (WRENCH_MIN + root_of(size_squared));
  if (multipliers) {
    is_small &= reduce_lambda_lanes(span, multipliers, count, lambda);
    mu = lanes_of(NEARLY);
  } else {
    first_lambda_lanes(robot, target, lambda, &mu);
  }
  for (int l = 0; l < count; l++) {
    for (int j = 0; j < 6; j++) {
      candidates[l].target[j] = target[j][l];
      candidates[l].lambda[j] = lambda[j][l];
    }
    candidates[l].mu = mu[l];
    candidates[l].is_met = 0;
  }
  return bits_of(is_in_range & is_small);
}

/* Takes over what a trial step came to, in some lanes. */
static inline void adopt(const lanes_robot *robot, mask chosen, lanes_state *at,
                         const lanes_state *trial) {
  for (int j = 0; j < 6; j++) {
    at->lambda[j] = select_lanes(chosen, trial->lambda[j], at->lambda[j]);
    at->residual[j] = select_lanes(chosen, trial->residual[j], at->residual[j]);
  }
  for (int i = 0; i < robot->n; i++) {
    const int rows = 1 + robot->actuator[i].is_plane;
    for (int row = 0; row < rows; row++) {
      at->force[i][row] = select_lanes(chosen, trial->force[i][row], at->force[i][row]);
    }
    for (int k = 0; k < 2 * rows - 1; k++) {
      at->dy_ds[i][k] = select_lanes(chosen, trial->dy_ds[i][k], at->dy_ds[i][k]);
    }
    at->secant[i] = select_lanes(chosen, trial->secant[i], at->secant[i]);
  }
  at->dual_value = select_lanes(chosen, trial->dual_value, at->dual_value);
  at->residual_size = select_lanes(chosen, trial->residual_size, at->residual_size);
}

/* mu after steps that are kept: mu_after_kept of dual_newton.c. */
static inline vector mu_after_kept_lanes(vector mu, vector slope_left) {
  const vector half = size_of_lanes(slope_left) / 2;
  vector factor = clipped_lanes(half, lanes_of(MU_KEPT_LEAST), lanes_of(1));
  factor = select_lanes(slope_left > R(0.5), lanes_of(MU_KEPT_EARLY), factor);
  return larger_of(mu * factor, lanes_of(ROUNDING));
}

/* mu after steps that are refused. A single question ends such a step at its top instead, see
   is_kept_at_top of dual_newton.c: a search would hold up all lanes. */
static inline vector mu_after_refused_lanes(vector mu, vector nu, vector slope_begin,
                                            vector slope_end, vector rise, vector damping) {
  const vector a = 3 * (slope_begin + slope_end - 2 * rise);
  const vector b = slope_end - slope_begin - a;
  const vector discriminant = b * b - 4 * a * slope_begin;
  const vector vertex = 2 * slope_begin / (root_of(discriminant) - b);
  const vector share = select_lanes(discriminant > 0, vertex, lanes_of(R(0.5)));
  const vector shorter = 1 / clipped_lanes(share, lanes_of(SHARE_LEAST), lanes_of(SHARE_MOST));
  const vector more = (shorter - 1) * slope_begin / damping;
  const vector by_damping = larger_of(mu * nu, mu + more);
  const vector shorter_at_kink =
      1 / clipped_lanes(share, lanes_of(SHARE_LEAST_AT_KINK), lanes_of(SHARE_MOST));
  const vector by_share = mu * larger_of(nu, shorter_at_kink);
  return larger_of(select_lanes(damping > 0, by_damping, by_share), lanes_of(ROUNDING));
}

/* Lanes on their way: which candidate each has, and its numbers. */
typedef struct {
  int candidate[LANES]; /* -1 for none */
  vector target[6];
  vector mu, nu;
  vector steps;  /* so far */
  mask is_taken; /* whether a lane has a candidate */
  mask is_fresh; /* whether it has not been evaluated yet */
} lanes_in_use;

/* Gives candidates of a chunk to lanes that have none, from a first one on; the multipliers to
   begin with go to `trial`. Returns the first candidate that is left. */
static inline int load_lanes(const candidate *candidates, const int *order, int next, int count,
                             lanes_in_use *lanes, lanes_state *trial) {
  for (int l = 0; l < LANES && next < count; l++) {
    if (lanes->candidate[l] >= 0) continue;
    const candidate *own = candidates + order[next];
    for (int j = 0; j < 6; j++) {
      set_lane(&lanes->target[j], l, own->target[j]);
      set_lane(&trial->lambda[j], l, own->lambda[j]);
    }
    lanes->candidate[l] = order[next];
    set_lane(&lanes->mu, l, own->mu);
    set_lane(&lanes->nu, l, 2);
    set_lane(&lanes->steps, l, 0);
    set_mask(&lanes->is_taken, l, 1);
    set_mask(&lanes->is_fresh, l, 1);
    next++;
  }
  return next;
}

/* Takes what lanes came to out of them: multipliers, and forces (count, n, 2) of the chunk. */
static inline void unload_lanes(const lanes_robot *robot, int leaving, int met,
                                const lanes_state *at, lanes_in_use *lanes, candidate *candidates,
                                real *force) {
  const int n = robot->n;
  for (int l = 0; l < LANES; l++) {
    if (!(leaving >> l & 1)) continue;
    const int index = lanes->candidate[l];
    lanes->candidate[l] = -1;
    set_mask(&lanes->is_taken, l, 0);
    candidates[index].is_met = met >> l & 1;
    if (!candidates[index].is_met) continue;
    for (int j = 0; j < 6; j++) candidates[index].lambda[j] = at->lambda[j][l];
    real *own = force + 2 * n * index;
    for (int i = 0; i < n; i++) {
      own[2 * i] = at->force[i][0][l];
      own[2 * i + 1] = 0;
      if (robot->actuator[i].is_plane) own[2 * i + 1] = at->force[i][1][l];
    }
  }
}

/* Newton's method for candidates of a chunk, in an order (count,): fl_dual_newton. */
static void newton_in_lanes(const lanes_robot *robot, candidate *candidates, const int *order,
                            int count, real *force) {
  const real beyond = robot->work->power_cost_max * (1 + NOTHING) + NOTHING; /* Eq. 13 */
  lanes_state states[2];
  lanes_state *at = states;
  lanes_state *trial = states + 1;
  lanes_in_use lanes;
  memset(&lanes, 0, sizeof lanes);
  for (int l = 0; l < LANES; l++) lanes.candidate[l] = -1;
  lanes.mu = lanes_of(1);
  lanes.nu = lanes_of(1);
  memset(at->lambda, 0, sizeof at->lambda);
  int next = load_lanes(candidates, order, 0, count, &lanes, at);
  evaluate(robot, lanes.target, at);
  lanes.is_fresh = no_lanes();
  for (;;) {
    /* What has come to its end leaves. */
    const mask is_met = at->residual_size <= SURE_SHARE * TOLERANCE;
    const mask is_beyond = at->dual_value > beyond;
    const mask has_diverged = ~(lanes.mu <= 1 / ROUNDING); /* or is NaN */
    const mask is_late = lanes.steps >= LANES_STEPS;
    const mask is_leaving = (is_met | is_beyond | has_diverged | is_late) & lanes.is_taken;
    const int leaving = bits_of(is_leaving);
    if (leaving) {
      unload_lanes(robot, leaving, bits_of(is_met), at, &lanes, candidates, force);
    }
    if (next == count && !bits_of(lanes.is_taken)) return;

    vector step[6];
    vector trace;
    const mask is_singular = newton_step_lanes(robot, at, lanes.mu, step, &trace);
    for (int j = 0; j < 6; j++) trial->lambda[j] = at->lambda[j] + step[j];
    lanes.steps += 1;
    if (leaving) next = load_lanes(candidates, order, next, count, &lanes, trial);
    evaluate(robot, lanes.target, trial);

    const vector slope_begin = dot_lanes(step, at->residual);
    const vector slope_end = dot_lanes(step, trial->residual);
    const vector slope_left = slope_end / larger_of(slope_begin, lanes_of(TINY)); /* Eq. 10 */
    const vector rise = trial->dual_value - at->dual_value;
    const vector slack = ROUNDING * size_of_lanes(at->dual_value);
    const mask has_fallen = trial->residual_size < FELL * at->residual_size;
    const mask is_uphill = (slope_left >= 0) | (rise > 0);
    const mask is_kept = (is_uphill | ((rise > -slack) & has_fallen)) & ~is_singular;
    const mask is_refused = ~(is_kept | lanes.is_fresh) & lanes.is_taken;
    const vector mu_kept = mu_after_kept_lanes(lanes.mu, slope_left);
    if (bits_of(is_refused)) {
      vector damping = lanes_of(0);
      if (!robot->work->has_kinks) damping = damping_along_lanes(robot, at, trace, step);
      vector mu_refused =
          mu_after_refused_lanes(lanes.mu, lanes.nu, slope_begin, slope_end, rise, damping);
      mu_refused = select_lanes(is_singular, lanes.mu * MU_SINGULAR, mu_refused);
      const vector mu_next = select_lanes(is_refused, mu_refused, mu_kept);
      lanes.mu = select_lanes(lanes.is_fresh, lanes.mu, mu_next);
      const vector nu_refused = select_lanes(is_singular, lanes.nu, 2 * lanes.nu);
      lanes.nu = select_lanes(is_refused, nu_refused, lanes_of(2));
      adopt(robot, ~is_refused, at, trial);
    } else {
      lanes.mu = select_lanes(lanes.is_fresh, lanes.mu, mu_kept);
      lanes.nu = lanes_of(2);
      lanes_state *other = at;
      at = trial;
      trial = other;
    }
    lanes.is_fresh = no_lanes();
  }
}

/* Commands of LANES targets and what they give, while they are found. */
typedef struct {
  int index[LANES];   /* of the targets in the batch; some may stand twice */
  vector residual[6]; /* of the wrench over the wrench scale */
  mask is_left;       /* whether a lane is left to fl_answer_one */
} lanes_answer;

/* An angle [rad] within half a turn of another one: fl_wrap_angle. */
static inline vector near_angle(vector angle, real middle) {
  const vector off = angle - middle;
  return middle + (off - 2 * PI * floor_of((off + PI) / (2 * PI)));
}

/* A direction (x, y) turned by a slight angle [rad]. */
static inline void turn_slightly(vector angle, vector *x, vector *y) {
  const vector squared = angle * angle;
  const vector cosine = 1 - squared / 2 * (1 - squared / 12);
  const vector sine = angle * (1 - squared / 6 * (1 - squared / 20));
  const vector turned = *x * cosine - *y * sine;
  *y = *x * sine + *y * cosine;
  *x = turned;
}

/* Four knots in a row on an axis, from a first one on, and their weights in a value: those of
   weights_at of command_law.c. At an end of the axis, where two of the four neighbours are one
   knot, it has the weight of both, and the window begins or ends with it. */
typedef struct {
  vector weight[4];
  vector first; /* index of the first knot */
} lanes_window;

/* The cell of an axis in which each lane lies; `cell` is a first guess, right where knots are
   even. */
static inline vector cell_by_search(const real *knot, int cells, vector x, vector cell) {
  for (int l = 0; l < LANES; l++) {
    int own = (int)cell[l];
    while (own > 0 && x[l] < knot[own]) own--;
    while (own < cells - 1 && x[l] >= knot[own + 1]) own++;
    cell[l] = own;
  }
  return cell;
}

/* The window of an axis without a period, of four knots or more, or of one. */
static inline lanes_window window_at(const real *knot, int count, vector x) {
  lanes_window window = {{{0}}, {0}};
  window.weight[0] = lanes_of(1);
  if (count == 1) return window;
  const int cells = count - 1;
  const vector last_cell = lanes_of(cells - 1);
  const real begin = knot[0];
  const real end = knot[cells];
  const vector held = clipped_lanes(x, lanes_of(begin), lanes_of(end));
  const vector position = (held - begin) * ((real)cells / (end - begin));
  vector cell = floor_of(clipped_lanes(position, lanes_of(0), last_cell));
  vector knots[4];
  vector low;
  vector high;
  for (int k = 0; k < 2; k++) {
    window.first = clipped_lanes(cell - 1, lanes_of(0), lanes_of(count - 4));
    gather_four(knot, integer_of(window.first), knots);
    low = select_lanes(cell == 0, knots[0], knots[1]);
    high = select_lanes(cell == 0, knots[1], knots[2]);
    low = select_lanes(cell == last_cell, knots[2], low);
    high = select_lanes(cell == last_cell, knots[3], high);
    const mask is_below = (held < low) & (cell > 0);
    const mask is_above = (held >= high) & (cell < last_cell);
    if (!bits_of(is_below | is_above)) break;
    cell = cell_by_search(knot, cells, held, cell);
  }
  const mask is_first = cell == 0;
  const mask is_last = cell == last_cell;
  const vector before = select_lanes(is_first, low, select_lanes(is_last, knots[1], knots[0]));
  const vector after = select_lanes(is_last, high, select_lanes(is_first, knots[2], knots[3]));
  const vector width = high - low;
  const vector t = (held - low) / width;
  const vector early = width / (high - before);
  const vector late = width / (after - low);
  vector neighbour[4]; /* weights */
  neighbour[0] = t * (-early + t * (2 * early - t * early));
  neighbour[1] = 1 + t * t * (late - 3 + t * (2 - late));
  neighbour[2] = t * (early + t * (3 - 2 * early + t * (early - 2)));
  neighbour[3] = t * t * (t * late - late);
  /* Of a first cell the neighbours are knots 0, 0, 1, 2 of the window; of a last one 1, 2, 3, 3. */
  const vector none = lanes_of(0);
  vector *weight = window.weight;
  weight[0] = select_lanes(is_first, neighbour[0] + neighbour[1], neighbour[0]);
  weight[0] = select_lanes(is_last, none, weight[0]);
  weight[1] = select_lanes(is_first, neighbour[2], neighbour[1]);
  weight[1] = select_lanes(is_last, neighbour[0], weight[1]);
  weight[2] = select_lanes(is_first, neighbour[3], neighbour[2]);
  weight[2] = select_lanes(is_last, neighbour[1], weight[2]);
  weight[3] = select_lanes(is_last, neighbour[2] + neighbour[3], neighbour[3]);
  weight[3] = select_lanes(is_first, none, weight[3]);
  return window;
}

/* Size of a fin's force by its law, at amplitudes and frequencies: grid_at of one column. */
static inline vector size_by_law(const real *grid, vector amplitude, vector frequency) {
  const int count[2] = {(int)grid[0], (int)grid[1]};
  const int is_product = grid[4] != 0;
  const int is_root = grid[6] != 0;
  const real *knot = grid + 7;
  const real *values = knot + count[0] + count[1] + (int)grid[2];
  vector along = amplitude;
  if (is_product) along = amplitude * frequency;
  const lanes_window rows = window_at(knot, count[0], along);
  const lanes_window columns = window_at(knot + count[0], count[1], frequency);
  vector size = lanes_of(0);
  for (int row = 0; row < 4 && row < count[0]; row++) {
    const mask index = integer_of((rows.first + row) * (real)count[1] + columns.first);
    vector value[4];
    vector of_row;
    if (count[1] == 1) {
      of_row = gather(values, index);
    } else {
      gather_four(values, index, value);
      of_row = columns.weight[0] * value[0] + columns.weight[1] * value[1] +
               columns.weight[2] * value[2] + columns.weight[3] * value[3];
    }
    size += rows.weight[row] * of_row;
  }
  if (is_root) size *= size;
  return size;
}

/* Amplitude and frequency for shares of a fin's largest force: beat_at. */
static inline void beat_in_lanes(const real *beat, vector share, vector *command) {
  const real cells = beat[0];
  const vector within = clipped_lanes(share, lanes_of(0), lanes_of(1));
  const vector position = root_of(within) * cells;
  const vector cell = floor_of(smaller_of(position, lanes_of(cells - 1)));
  vector row[4]; /* amplitude and frequency at both ends of the cell */
  gather_four(beat + 1, integer_of(2 * cell), row);
  for (int k = 0; k < 2; k++) command[k] = row[k] + (row[k + 2] - row[k]) * (position - cell);
}

/* Number k of a command within its limits. */
static inline vector clipped_number(const fl_actuator *a, int k, vector value) {
  return clipped_lanes(value, lanes_of(a->command_min[k]), lanes_of(a->command_max[k]));
}

/* Takes a force (x, y) along the rows off the residual of the wrench. */
static inline void take_off(const lanes_robot *robot, int i, vector x, vector y,
                            lanes_answer *answer) {
  const fl_actuator *a = ACTUATOR(robot->block, i);
  if (robot->work->span.is_lost[i]) return;
  const int is_plane = robot->actuator[i].is_plane;
  const real *along = a->effectiveness_normalized[is_plane];
  const real *across = a->effectiveness_normalized[2];
  for (int k = 0; k < 6; k++) {
    answer->residual[k] -= x * along[k];
    if (is_plane) answer->residual[k] -= y * across[k];
  }
}

/* Whether forces of a plane may lie in a gap of its set: fl_may_have_gaps and fl_gap_of. */
static inline mask may_be_in_gap(const lanes_actuator *a, const fl_actuator *given, vector x,
                                 vector y, vector size) {
  mask may_be = size < a->force_min * SHORTER;
  if (a->has_arc && a->half_angle > NARROW) {
    const vector along = x * a->center[0] + y * a->center[1];
    const vector across = size_of_lanes(y * a->center[0] - x * a->center[1]);
    const vector beyond_end = across * a->half[0] - along * a->half[1]; /* sine, times the size */
    may_be |= (beyond_end > CLOSE / 2 * size) & (size > NEARLY * given->row_force_max[0]);
  }
  return may_be;
}

/* The command of one actuator for its forces: thruster_command, pod_command and fin_command. */
static inline void command_in_lanes(const lanes_robot *robot, int i, vector x, vector y,
                                    lanes_answer *answer, vector *command) {
  const lanes_actuator *own = &robot->actuator[i];
  const fl_actuator *a = ACTUATOR(robot->block, i);
  for (int k = 0; k < 3; k++) command[k] = lanes_of(0);
  if (!own->is_plane) {
    command[0] = clipped_number(a, 0, x * a->command_sign);
    if (a->dead_band > 0) {
      answer->is_left |= (size_of_lanes(x) < a->dead_band) & (x != 0);
    }
    take_off(robot, i, command[0], x, answer);
    return;
  }
  const vector size = root_of(x * x + y * y);
  const mask is_at_rest = size <= TINY;
  const vector inverse = 1 / size;
  vector along_x = select_lanes(is_at_rest, lanes_of(1), x * inverse);
  vector along_y = select_lanes(is_at_rest, lanes_of(0), y * inverse);
  if (!robot->work->span.is_lost[i]) answer->is_left |= may_be_in_gap(own, a, x, y, size);
  vector angle = {0};
  for (int l = 0; l < LANES; l++) angle[l] = ATAN2(along_y[l], along_x[l]);
  int angle_number = 0;
  real lean = 0;
  if (own->kind == FL_FIN) {
    angle_number = 2;
    lean = a->lean_angle;
  }
  const real low = a->command_min[angle_number];
  const real high = a->command_max[angle_number];
  const vector wanted_angle = near_angle(angle - lean, (low + high) / 2);
  const vector held_angle = clipped_number(a, angle_number, wanted_angle);
  const vector turn = held_angle - wanted_angle;
  if (bits_of(turn != 0)) {
    answer->is_left |= size_of_lanes(turn) > SLIGHT;
    turn_slightly(turn, &along_x, &along_y);
  }
  command[angle_number] = held_angle;
  vector given;
  if (own->kind == FL_POD) {
    given = clipped_number(a, 1, size);
    if (a->dead_band > 0) answer->is_left |= (given < a->dead_band) & (given != 0);
    command[1] = given;
  } else {
    const real *beat = robot->block + (int)a->command_table;
    const real *grid = robot->block + (int)a->law_grid;
    beat_in_lanes(beat, size / a->force_max, command);
    for (int k = 0; k < 2; k++) command[k] = clipped_number(a, k, command[k]);
    given = size_by_law(grid, command[0], command[1]);
    const vector wanted = larger_of(size + size - given, lanes_of(0));
    beat_in_lanes(beat, wanted / a->force_max, command);
    for (int k = 0; k < 2; k++) command[k] = clipped_number(a, k, command[k]);
    given = size_by_law(grid, command[0], command[1]);
  }
  take_off(robot, i, given * along_x, given * along_y, answer);
}

/* Commands for the forces of targets of the batch, and what else belongs to their answers. */
static void finish_lanes(const lanes_robot *robot, const lanes_batch *batch, int first,
                         const candidate *candidates, const int *met, int count) {
  const int n = robot->n;
  const fl_span *span = &robot->work->span;
  const real *scale = HEAD(robot->block)->wrench_scale;
  lanes_answer answer;
  answer.is_left = no_lanes();
  for (int l = 0; l < LANES; l++) answer.index[l] = first + met[l < count ? l : count - 1];
  for (int k = 0; k < 6; k++) {
    vector w = {0};
    if (span->axis_counts[k]) {
      for (int l = 0; l < LANES; l++) w[l] = batch->wrench[6 * answer.index[l] + k];
    }
    for (int l = 0; l < LANES; l++) batch->wrench_served[6 * answer.index[l] + k] = w[l];
    answer.residual[k] = (w - span->wrench_offset[k]) / scale[k];
  }
  for (int i = 0; i < n; i++) {
    vector x = {0};
    vector y = {0};
    vector command[3];
    for (int l = 0; l < LANES; l++) {
      x[l] = batch->force[2 * (n * answer.index[l] + i)];
      y[l] = batch->force[2 * (n * answer.index[l] + i) + 1];
    }
    command_in_lanes(robot, i, x, y, &answer, command);
    for (int l = 0; l < LANES; l++) {
      real *own = batch->command + 3 * (n * answer.index[l] + i);
      for (int k = 0; k < 3; k++) own[k] = command[k][l];
    }
  }
  vector error_squared = {0};
  for (int k = 0; k < 6; k++) {
    if (span->axis_counts[k]) error_squared += answer.residual[k] * answer.residual[k];
  }
  const vector error = root_of(error_squared);
  answer.is_left |= ~(error <= EXACT);
  const int left = bits_of(answer.is_left);
  for (int l = 0; l < count; l++) {
    const int index = answer.index[l];
    const real *lambda = candidates[index - first].lambda;
    batch->is_answered[index] = !(left >> l & 1);
    batch->error[index] = error[l];
    for (int k = 0; k < 6; k++) {
      batch->multipliers[6 * index + k] = dot(span->basis[k], lambda, span->rank) /
                                          span->axis_scale[k];
    }
  }
}

/* Answers a batch, a chunk after the other. */
static void answer_in_lanes(const lanes_robot *robot, const lanes_batch *batch) {
  candidate candidates[CHUNK];
  int order[CHUNK];
  for (int first = 0; first < batch->count; first += CHUNK) {
    int chunk = batch->count - first;
    if (chunk > CHUNK) chunk = CHUNK;
    int count = 0; /* of what is in range, and then of what is met */
    for (int k = 0; k < chunk; k += LANES) {
      int some = chunk - k;
      if (some > LANES) some = LANES;
      const real *multipliers = 0;
      if (batch->multipliers_first) multipliers = batch->multipliers_first + 6 * (first + k);
      const int may_be_met =
          begin_lanes(robot, batch->wrench + 6 * (first + k), multipliers, some, candidates + k);
      for (int l = 0; l < some; l++) {
        batch->is_answered[first + k + l] = 0;
        if (may_be_met >> l & 1) order[count++] = k + l;
      }
    }
    newton_in_lanes(robot, candidates, order, count, batch->force + 2 * robot->n * first);
    int met = 0;
    for (int k = 0; k < count; k++) {
      if (candidates[order[k]].is_met) order[met++] = order[k];
    }
    for (int k = 0; k < met; k += LANES) {
      int some = met - k;
      if (some > LANES) some = LANES;
      finish_lanes(robot, batch, first, candidates, order + k, some);
    }
  }
}
