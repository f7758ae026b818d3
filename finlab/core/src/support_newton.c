/* Newton's method for the point of the attainable set that is nearest to a target, and for the end
   of a ray in it, by the normal m of the set there.

       min over m of  |m|^2 / 2 + h(m) - c.m              the point nearest to c is c - m
       min over m of  h(m) - c.m   where  e.m = 1         the ray c + t e ends at this t

   h is the support function of Eq. 12, a sum over actuators of h_i(s_i) with the prices
   s_i = B_i' m. Each h_i has a kink where its price is 0: there the force is any of the set, as the
   conditions of optimality need it, and at the optimum that holds of several actuators. So kinks
   are rounded off, by proximal terms with a centre z_i of each actuator's forces:

       max over y in Y_i of  s_i.y - |y - z_i|^2 / (2 rho_i)

   whose y is the force of Y_i nearest to z_i + rho_i s_i.

   Newton's method finds the least m of that, forces y become the centres, and rho grows: a few
   rounds come to the optimum (method of multipliers; Rockafellar, "Augmented Lagrangians and
   applications of the proximal point algorithm", 1976). A ray has a proximal term of m, too:
   |m - m_k|^2 sigma / 2.

   The caller proves what comes of it, and goes on by Wolfe's algorithm (nearest_point.c) where it
   is no answer. That knows sets of all kinds; here are lines, and planes that are full circles. */
#include "internal.h"

#define ROUNDS 12       /* of new centres, at most */
#define ROUND_STEPS 20  /* of Newton's method in a round, at most */
#define LINE_STEPS 8    /* of a search along a step, at most */
#define RHO_FIRST 10    /* rho times the mean worth of a force, over its squared half range */
#define RHO_GROWTH 10   /* from round to round */
#define RHO_MOST 1e4    /* above that the rounding of rho s would be that of forces */
#define SIGMA_FIRST 0.1 /* sigma over the mean of the Hessian at the first rho */
#define LOOSE 1e-3      /* residual that ends the first round, over the size of c or e */
#define SHORT 1e-6      /* step over the normal that is not searched: slopes there are rounding */
#define LEFT 0.5        /* share of the slope at the end of a step from which it is searched */
#define CLOSER 0.01     /* residual that ends the last round, over the distance that is asked for */

typedef struct {
  const real *block;
  const fl_work *work;
  const wide *center;  /* c (6,), in weighted axes */
  const wide *ray;     /* e (6,); 0 for none */
  wide size;           /* of c or e */
  wide normal[6];      /* m */
  wide last_normal[6]; /* m_k */
  wide sigma;
  wide rho;                /* of a force whose half range is 1 N */
  wide ray_size;           /* t */
  wide gradient[6];        /* of the rounded function; of a ray less t e */
  wide middle[FL_MOST];    /* of a line's forces [N] */
  wide half[FL_MOST];      /* half range of a line, radius of a plane [N] */
  wide (*force)[2];        /* y (n, 2) [N] */
  wide (*force_center)[2]; /* z (n, 2) [N] */
  wide price[FL_MOST][2];  /* s */
  wide change[FL_MOST][2]; /* of the prices in a step */
  wide slope[FL_MOST][3];  /* dy/ds: xx, xy, yy */
} support_problem;

static int is_line(const support_problem *p, int i) { return ACTUATOR(p->block, i)->rows == 1; }

/* Whether no actuator pushes in a plane: all sets are boxes, where Wolfe's algorithm ends at
   rounding after few steps. */
int fl_has_lines_alone(const real *block) {
  for (int i = 0; i < COUNT(block); i++) {
    if (ACTUATOR(block, i)->rows != 1) return 0;
  }
  return 1;
}

/* Takes the set of each actuator; 0 where one is of a kind that is not known here. */
static int take_sets(support_problem *p) {
  if (p->work->has_drag || fl_has_lines_alone(p->block)) return 0;
  for (int i = 0; i < COUNT(p->block); i++) {
    const fl_actuator *a = ACTUATOR(p->block, i);
    const fl_set *set = p->work->set + i;
    if (p->work->polygon_offset[i] > 0) return 0;
    if (a->rows == 1) {
      p->middle[i] = ((wide)set->force_max + (wide)set->force_min) / 2;
      p->half[i] = ((wide)set->force_max - (wide)set->force_min) / 2;
      continue;
    }
    const int is_circle = set->sector_half_angle >= PI && !has_gauge_table(a);
    if (!is_circle) return 0;
    p->middle[i] = 0;
    p->half[i] = larger_wide(set->force_max, set->force_max_reverse);
  }
  return 1;
}

/* Prices (2,) of an actuator along a direction (6,). */
static void prices_along(const support_problem *p, int i, const wide *direction, wide *price) {
  const wide(*column)[6] = p->work->effectiveness_weighted[i];
  price[0] = dot_wide(column[0], direction, 6);
  price[1] = 0;
  if (!is_line(p, i)) price[1] = dot_wide(column[1], direction, 6);
}

static void find_prices(support_problem *p) {
  for (int i = 0; i < COUNT(p->block); i++) prices_along(p, i, p->normal, p->price[i]);
}

/* h_i(s_i): what the farthest force of an actuator is worth. */
static wide support_of(const support_problem *p, int i) {
  const wide *s = p->price[i];
  return p->middle[i] * s[0] + p->half[i] * sqrt(dot_wide(s, s, 2));
}

static wide support_at_normal(const support_problem *p) {
  wide sum = 0;
  for (int i = 0; i < COUNT(p->block); i++) sum += support_of(p, i);
  return sum;
}

/* The force (2,) of an actuator nearest to z + rho s, after a share of the step; its derivative by
   the price goes to `slope`, 0 for none. */
static void force_after(const support_problem *p, int i, wide share, wide *force, wide *slope) {
  const wide half = p->half[i];
  const wide rho = p->rho * half * half;
  const wide *z = p->force_center[i];
  const wide x = z[0] + rho * (p->price[i][0] + share * p->change[i][0]);
  const wide y = z[1] + rho * (p->price[i][1] + share * p->change[i][1]);
  const wide ahead = x - p->middle[i];
  const wide size = sqrt(ahead * ahead + y * y); /* from the middle of the set */
  const int is_within = size <= half;
  wide times = 1; /* of what leads from the middle to the force */
  if (!is_within) times = half / size;
  force[0] = p->middle[i] + times * ahead;
  force[1] = times * y;
  if (!slope) return;
  slope[0] = slope[1] = slope[2] = 0;
  if (is_within) {
    slope[0] = rho;
    slope[2] = rho;
  } else if (!is_line(p, i)) {
    const wide turning = rho * times;
    const wide gx = ahead / size;
    const wide gy = y / size;
    slope[0] = turning * gy * gy;
    slope[1] = -turning * gx * gy;
    slope[2] = turning * gx * gx;
  }
}

/* Forces and their slopes at the normal, and the gradient there; its size. */
static wide find_gradient(support_problem *p) {
  for (int i = 0; i < COUNT(p->block); i++) force_after(p, i, 0, p->force[i], p->slope[i]);
  wide *g = p->gradient;
  fl_point_of_forces(p->block, p->work, p->force, g);
  add_scaled(g, -1, p->center);
  if (p->ray) {
    p->ray_size = dot_wide(g, p->ray, 6) / (p->size * p->size);
    add_scaled(g, -p->ray_size, p->ray);
    add_scaled(g, p->sigma, p->normal);
    add_scaled(g, -p->sigma, p->last_normal);
  } else {
    add_scaled(g, 1, p->normal);
  }
  return norm_wide(g);
}

/* Turns the lower triangle of A into its Cholesky factor, the diagonal inverse; 0 where A is
   singular to rounding. */
static int factor_wide(wide A[6][6]) {
  for (int i = 0; i < 6; i++) {
    for (int j = 0; j < i; j++) A[i][j] = (A[i][j] - dot_wide(A[i], A[j], j)) * A[j][j];
    const wide left = A[i][i] - dot_wide(A[i], A[i], i);
    if (!(left > 0)) return 0;
    A[i][i] = 1 / sqrt(left);
  }
  return 1;
}

/* Solves L L' x = x in place, L of factor_wide. */
static void solve_wide(wide L[6][6], wide *x) {
  for (int i = 0; i < 6; i++) x[i] = (x[i] - dot_wide(L[i], x, i)) * L[i][i];
  for (int i = 5; i >= 0; i--) {
    x[i] *= L[i][i];
    for (int k = 0; k < i; k++) x[k] -= L[i][k] * x[i];
  }
}

/* Adds B D B' to the lower triangle of H, D = (xx, xy; xy, yy). */
static void add_hessian(wide H[6][6], const wide (*column)[6], const wide *slope, int line) {
  for (int row = 0; row < 6; row++) {
    const wide x = slope[0] * column[0][row] + slope[1] * column[1][row];
    for (int col = 0; col <= row; col++) H[row][col] += x * column[0][col];
    if (line) continue;
    const wide y = slope[1] * column[0][row] + slope[2] * column[1][row];
    for (int col = 0; col <= row; col++) H[row][col] += y * column[1][col];
  }
}

/* Newton's step (6,) of the normal; 0 where there is none. */
static int find_step(const support_problem *p, wide *step) {
  wide H[6][6] = {{0}};
  for (int i = 0; i < COUNT(p->block); i++) {
    const int line = is_line(p, i);
    if (line && p->slope[i][0] == 0) continue;
    add_hessian(H, p->work->effectiveness_weighted[i], p->slope[i], line);
  }
  wide regular = 1; /* Hessian of |m|^2 / 2 */
  if (p->ray) regular = p->sigma;
  for (int k = 0; k < 6; k++) H[k][k] += regular;
  if (!factor_wide(H)) return 0;
  for (int k = 0; k < 6; k++) step[k] = -p->gradient[k];
  solve_wide(H, step);
  if (!p->ray) return 1;
  wide along[6]; /* H^-1 e, by which e.m stays 1 */
  memcpy(along, p->ray, sizeof along);
  solve_wide(H, along);
  const wide missing = 1 - dot_wide(p->ray, p->normal, 6) - dot_wide(p->ray, step, 6);
  add_scaled(step, missing / dot_wide(p->ray, along, 6), along);
  return 1;
}

/* The slope of the rounded function along a step, after a share of it. */
static wide slope_after(const support_problem *p, const wide *step, wide share) {
  wide slope = -dot_wide(p->center, step, 6);
  if (p->ray) {
    slope += p->sigma * (dot_wide(p->normal, step, 6) - dot_wide(p->last_normal, step, 6));
    slope += p->sigma * share * dot_wide(step, step, 6);
  } else {
    slope += dot_wide(p->normal, step, 6) + share * dot_wide(step, step, 6);
  }
  for (int i = 0; i < COUNT(p->block); i++) {
    wide force[2];
    force_after(p, i, share, force, 0);
    slope += dot_wide(force, p->change[i], 2);
  }
  return slope;
}

/* The share of a step up to which the rounded function falls: all of it, or where its slope is
   about 0 (regula falsi; Illinois). */
static wide search_along(const support_problem *p, const wide *step) {
  if (norm_wide(step) <= SHORT * norm_wide(p->normal)) return 1;
  wide low = 0;
  wide high = 1;
  wide slope_high = slope_after(p, step, 1);
  wide slope_low = dot_wide(p->gradient, step, 6);
  const wide enough = LEFT * fabs(slope_low);
  wide share = 1;
  wide slope = slope_high;
  for (int k = 0; k < LINE_STEPS && fabs(slope) > enough && slope_high > 0; k++) {
    share = (low * slope_high - high * slope_low) / (slope_high - slope_low);
    slope = slope_after(p, step, share);
    if (slope > 0) {
      high = share;
      slope_high = slope;
      slope_low /= 2;
    } else {
      low = share;
      slope_low = slope;
      slope_high /= 2;
    }
  }
  return share;
}

/* Newton's method for given centres, until the gradient is `enough`; 0 where it does not come to
   that. */
static int settle(support_problem *p, wide enough) {
  memset(p->change, 0, sizeof p->change[0] * (size_t)COUNT(p->block));
  wide size = find_gradient(p);
  for (int k = 0; k < ROUND_STEPS; k++) {
    if (k > 0 && size <= enough) return 1;
    wide step[6];
    if (!find_step(p, step)) return 0;
    for (int i = 0; i < COUNT(p->block); i++) prices_along(p, i, step, p->change[i]);
    const wide share = search_along(p, step);
    add_scaled(p->normal, share, step);
    for (int i = 0; i < COUNT(p->block); i++) {
      for (int q = 0; q < 2; q++) {
        p->price[i][q] += share * p->change[i][q];
        p->change[i][q] = 0;
      }
    }
    size = find_gradient(p);
  }
  return size <= enough;
}

/* What the farthest forces along the normal are worth more than those found. */
static wide gain_of_farthest(const support_problem *p) {
  wide gain = 0;
  for (int i = 0; i < COUNT(p->block); i++) {
    gain += support_of(p, i) - dot_wide(p->force[i], p->price[i], 2);
  }
  return gain;
}

/* Rounds from the normal on, to a distance `close`; whether they come to it. */
static int come_to_optimum(support_problem *p, wide close) {
  const int n = COUNT(p->block);
  wide worth = 0;
  wide trace = 0; /* of the Hessian where no force is at a limit and rho is 1 */
  for (int i = 0; i < n; i++) {
    const wide(*column)[6] = p->work->effectiveness_weighted[i];
    worth += support_of(p, i) - p->middle[i] * p->price[i][0];
    p->force_center[i][0] = p->middle[i];
    p->force_center[i][1] = 0;
    wide squared = dot_wide(column[0], column[0], 6);
    if (!is_line(p, i)) squared += dot_wide(column[1], column[1], 6);
    trace += squared * p->half[i] * p->half[i];
  }
  if (!(worth > 0)) return 0;
  wide times = RHO_FIRST; /* rho times the mean worth */
  wide enough = LOOSE * p->size;
  p->sigma = SIGMA_FIRST / 6 * trace * (wide)n / worth;
  const wide exact = CLOSER * close;
  for (int round = 0; round < ROUNDS; round++) {
    p->rho = times * (wide)n / worth;
    memcpy(p->last_normal, p->normal, sizeof p->normal);
    if (!settle(p, larger_wide(enough, exact))) return 0;
    const wide gain = gain_of_farthest(p);
    wide enough_gain = close / 2 * norm_wide(p->normal);
    if (p->ray) enough_gain = close / 2 * p->size;
    wide residual = norm_wide(p->gradient);
    if (p->ray) {
      for (int k = 0; k < 6; k++) residual += p->sigma * fabs(p->normal[k] - p->last_normal[k]);
    }
    if (gain <= enough_gain && residual <= 2 * exact) return 1;
    memcpy(p->force_center, p->force, (size_t)n * sizeof p->force[0]);
    enough /= RHO_GROWTH;
    if (times < RHO_MOST) {
      times *= RHO_GROWTH;
      p->sigma /= RHO_GROWTH;
    }
  }
  return 0;
}

/* Keeps forces and their centres where a mixture has room for two more points; whether it has. */
static int has_room(support_problem *p, fl_mixture *m) {
  p->force = m->force[FL_POINTS - 2];
  p->force_center = m->force[FL_POINTS - 1];
  return m->count <= FL_POINTS - 2;
}

/* Makes the mixture one point, that of the forces. */
static void make_mixture(const support_problem *p, fl_mixture *m) {
  m->count = 1;
  m->actuators = COUNT(p->block);
  m->basis_count = 0;
  m->weight[0] = 1;
  m->ray_share[0] = 0;
  memcpy(m->force[0], p->force, (size_t)COUNT(p->block) * sizeof p->force[0]);
  fl_point_of_forces(p->block, p->work, m->force[0], m->point[0]);
}

/* Makes a mixture the point nearest to a target (6,) in weighted axes, from a normal (6,) on that
   parts it from the set. Returns whether the steps came to one, to so much `close`; where they did
   not, the mixture stays as it was. */
int fl_nearest_by_normal(const real *block, const fl_work *work, const wide *target_weighted,
                         const wide *normal, wide close, fl_mixture *m) {
  support_problem p;
  p.block = block;
  p.work = work;
  p.center = target_weighted;
  p.ray = 0;
  p.size = norm_wide(target_weighted);
  if (!take_sets(&p)) return 0;
  memcpy(p.normal, normal, sizeof p.normal);
  find_prices(&p);
  /* The best length of the normal. */
  const wide gap = dot_wide(p.center, p.normal, 6) - support_at_normal(&p);
  const wide squared = dot_wide(p.normal, p.normal, 6);
  if (!(gap > 0) || !has_room(&p, m)) return 0;
  for (int k = 0; k < 6; k++) p.normal[k] *= gap / squared;
  find_prices(&p);
  if (!come_to_optimum(&p, close)) return 0;
  make_mixture(&p, m);
  return 1;
}

/* Makes a mixture the point where a ray (6,) from a point (6,) ends in the set, from a normal (6,)
   on; m->miss becomes the normal there. Returns as fl_nearest_by_normal. */
int fl_end_of_ray_by_normal(const real *block, const fl_work *work, const wide *from,
                            const wide *ray, const wide *normal, wide close, fl_mixture *m) {
  support_problem p;
  p.block = block;
  p.work = work;
  p.center = from;
  p.ray = ray;
  p.size = norm_wide(ray);
  if (!take_sets(&p)) return 0;
  memcpy(p.normal, normal, sizeof p.normal);
  if (!(dot_wide(ray, p.normal, 6) > 0)) memcpy(p.normal, ray, sizeof p.normal);
  const wide across = dot_wide(ray, p.normal, 6);
  if (!(across > 0) || !has_room(&p, m)) return 0;
  for (int k = 0; k < 6; k++) p.normal[k] /= across;
  find_prices(&p);
  if (!come_to_optimum(&p, close)) return 0;
  make_mixture(&p, m);
  memcpy(m->miss, p.normal, sizeof m->miss);
  return 1;
}
