/* The point of a convex set nearest to another, and the farthest along a ray, by support functions alone.

   Wolfe's algorithm ("Finding the nearest point in a polytope", 1976): the nearest point is kept as a mixture
   of few points that answered prices. Each step asks for the point that is worth most along the miss, and takes
   the nearest point of the affine hull of all, points whose share would fall below 0 left out. What the last
   answer adds proves how far the point is from the nearest one. Sets with curved sides converge the same way. */
#include "inner.h"

#define MOST_POINTS 400
#define MOST_SHARES (5 * ROUNDS)

/* The wrench, in weighted axes, that each force gives per newton. */
void weigh(const real *block, fl_work *work, const real *weight) {
  const fl_head *h = HEAD(block);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    work->corners[i] = 0;
    for (int q = 0; q < 2; q++)
      for (int k = 0; k < 6; k++)
        work->column[i][q][k] = q < a->rows ? weight[k] * h->scale[k] * dot(h->basis[k], a->matrix[q], RANGE(block)) : 0;
  }
}

/* The corner of a polygon, a count and pairs, that is worth most. */
static void best_corner(const real *polygon, const real *price, real *force) {
  real most = -R(1e30);
  for (const real *at = polygon + 1, *end = at + 2 * (int)polygon[0]; at < end; at += 2)
    if (dot(price, at, 2) > most) most = dot(price, at, 2), force[0] = at[0], force[1] = at[1];
}

/* The forces that are worth most at a normal (6,), and the point (6,) that they give. */
static void farthest(const real *block, const fl_work *work, const real *normal, real force[][2], real *point) {
  memset(point, 0, 6 * sizeof *point);
  for (int i = 0; i < COUNT(block); i++) {
    const real(*column)[6] = work->column[i];
    real own[2] = {dot(column[0], normal, 6), dot(column[1], normal, 6)};
    if (work->corners[i] > 0)
      best_corner(block + work->corners[i], own, force[i]);
    else
      farthest_of(block, i, work->set + i, own, force[i]);
    for (int k = 0; k < 6; k++) point[k] += force[i][0] * column[0][k] + force[i][1] * column[1][k];
  }
}

static void drop(fl_mixture *m, int k) {
  m->count--, m->done = MIN(m->done, k);
  memmove(m->force + k, m->force + k + 1, (m->count - k) * sizeof m->force[0]);
  memmove(m->point + k, m->point + k + 1, (m->count - k) * sizeof m->point[0]);
  memmove(m->share + k, m->share + k + 1, (m->count - k) * sizeof m->share[0]);
}

/* Shares, which add up to 1, of the points that come nearest to a target; a point that depends on those before it
   gets 0. By Gram-Schmidt, again where little is left, as points near to each other are nearly dependent. */
static void affine(fl_mixture *m, const real *target, real *share) {
  real right[FL_POINTS], rest[6];
  for (int j = MAX(m->done, 1); j < m->count; j++) {
    real *q = m->q[j], size;
    for (int k = 0; k < 6; k++) q[k] = m->point[j][k] - m->point[0][k];
    for (int i = 1; i < j; i++) m->r[i][j] = 0;
    m->r[j][j] = size = SQRT(dot(q, q, 6));
    for (int twice = 0; twice < 2 && !(twice && m->r[j][j] > R(0.1) * size); twice++) {
      for (int i = 1; i < j; i++) {
        real part = dot(m->q[i], q, 6);
        m->r[i][j] += part;
        for (int k = 0; k < 6; k++) q[k] -= part * m->q[i][k];
      }
      m->r[j][j] = SQRT(dot(q, q, 6));
    }
    if (m->r[j][j] <= ROUNDING * size) m->r[j][j] = 0;
    real over = m->r[j][j] > 0 ? 1 / m->r[j][j] : 0;
    for (int k = 0; k < 6; k++) q[k] *= over;
  }
  m->done = m->count;
  for (int k = 0; k < 6; k++) rest[k] = target[k] - m->point[0][k];
  for (int j = 1; j < m->count; j++) {
    right[j] = dot(m->q[j], rest, 6);
    for (int k = 0; k < 6; k++) rest[k] -= right[j] * m->q[j][k];
  }
  share[0] = 1;
  for (int j = m->count - 1; j > 0; j--) {
    real sum = right[j];
    for (int k = j + 1; k < m->count; k++) sum -= m->r[j][k] * share[k];
    share[j] = m->r[j][j] > 0 ? sum / m->r[j][j] : 0;
    share[0] -= share[j];
  }
}

/* Shares of the points whose mixture is nearest to a target; points without a share are left out. */
static void mix(fl_mixture *m, const real *target) {
  real wanted[FL_POINTS];
  while (m->count > 1) {
    real step = 1, sum = 0;
    int least = 0, all = 1;
    affine(m, target, wanted);
    for (int k = 0; k < m->count; k++)
      if (wanted[k] <= ROUNDING) {
        all = 0;
        step = MIN(step, m->share[k] / MAX(m->share[k] - wanted[k], TINY));
      }
    if (all) {
      memcpy(m->share, wanted, sizeof wanted);
      return;
    }
    for (int k = 0; k < m->count; k++) {
      m->share[k] += step * (wanted[k] - m->share[k]);
      if (m->share[k] < m->share[least]) least = k;
    }
    m->share[least] = 0;
    for (int k = m->count - 1; k >= 0; k--)
      if (m->share[k] <= ROUNDING) drop(m, k);
    for (int k = 0; k < m->count; k++) sum += m->share[k];
    for (int k = 0; k < m->count; k++) m->share[k] /= sum;
  }
  m->share[0] = 1;
}

static void miss_of(fl_mixture *m, const real *target) {
  for (int k = 0; k < 6; k++) {
    m->miss[k] = -target[k];
    for (int p = 0; p < m->count; p++) m->miss[k] += m->share[p] * m->point[p][k];
  }
}

/* Makes a mixture the point nearest to a target (6,); it begins at the mixture, where that has points. Up to the
   distance `close` a point is the nearest one; `apart` is the share of a miss to be proved. Where there is a miss,
   what is worth most across it follows the mixture's points. */
void nearest_point(const real *block, const fl_work *work, const real *target, real close, real apart, fl_mixture *m) {
  real last = R(1e30);
  if (m->count == 0) {
    farthest(block, work, target, m->force[0], m->point[0]);
    m->count = 1, m->done = 0, m->share[0] = 1;
  }
  for (int k = 1;; k++) {
    miss_of(m, target);
    real size = SQRT(dot(m->miss, m->miss, 6)), normal[6], gain = 0;
    if (size <= close) return;
    if (m->count == FL_POINTS) { /* more than an affine basis: the one of least share goes */
      int least = 0;
      for (int p = 1; p < m->count; p++)
        if (m->share[p] < m->share[least]) least = p;
      drop(m, least);
    }
    for (int j = 0; j < 6; j++) normal[j] = -m->miss[j];
    farthest(block, work, normal, m->force[m->count], m->point[m->count]);
    for (int j = 0; j < 6; j++) gain += m->miss[j] * (target[j] + m->miss[j] - m->point[m->count][j]);
    if (gain <= MAX(close, apart * size) * size || size >= last * (1 - ROUNDING) || k == MOST_POINTS) return;
    last = size;
    m->share[m->count++] = 0;
    mix(m, target);
  }
}

/* The point of the set that is farthest along a ray (6,) from a point (6,), at sizes from `least` to `most`. A plane
   across the miss of a size bounds it from above, and is kept; the next try is that bound (Dinkelbach), until it
   is as `close`. Returns the bound; where no size is in the set, the least one, and the point is the nearest to it. */
real farthest_along(const real *block, const fl_work *work, const real *from, const real *ray, real least, real most,
                    real close, fl_mixture *m, real *plane) {
  real size = most, last = R(1e30), normal[6], target[6];
  memcpy(normal, ray, sizeof normal);
  farthest(block, work, ray, m->force[0], m->point[0]);
  m->count = m->done = 0, m->share[0] = 1;
  for (int k = 0; k < MOST_SHARES; k++) {
    real across = dot(normal, ray, 6), bound = least;
    if (across > 0) bound = (dot(m->point[m->count], normal, 6) - dot(from, normal, 6)) / across;
    if (bound < size) size = MAX(bound, least), memcpy(plane, normal, sizeof normal);
    for (int j = 0; j < 6; j++) target[j] = from[j] + size * ray[j];
    m->count = MAX(m->count, 1);
    nearest_point(block, work, target, close, R(0.5), m);
    for (int j = 0; j < 6; j++) normal[j] = -m->miss[j];
    real miss = SQRT(dot(normal, normal, 6));
    if (size == least || miss <= 2 * close || (size >= last && miss <= STALLED)) break;
    last = size >= last ? size - miss / (2 * SQRT(dot(ray, ray, 6))) : size;
    size = last;
  }
  return size;
}

void mixed_force(const real *block, const fl_mixture *m, real force[][2]) {
  for (int i = 0; i < COUNT(block); i++)
    for (int q = 0; q < 2; q++) {
      force[i][q] = 0;
      for (int p = 0; p < m->count; p++) force[i][q] += m->share[p] * m->force[p][i][q];
    }
}
