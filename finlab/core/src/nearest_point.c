/* The point of a convex set nearest to another, and the farthest along a ray, by support functions alone.

   Wolfe's algorithm ("Finding the nearest point in a polytope", 1976): the nearest point is kept as a mixture
   of few points that answered prices. Each step asks for the point that is worth most along the miss, and takes
   the nearest point of the affine hull of all, points whose share would fall below 0 left out. What the last
   answer adds proves how far the point is from the nearest one. Sets with curved sides converge the same way. */
#include "internal.h"

#define BARELY ((wide)NEARLY * NEARLY) /* rounding of shares and misses, which are in double precision always */
#define MOST_POINTS 400
#define MOST_SHARES (5 * ROUNDS)

/* An axis of a scaled wrench in the basis, on the yardstick. */
wide fl_out_of_range(const real *block, const fl_work *work, const real *inner, int axis) {
  const fl_span *span = &work->span;
  wide sum = 0;
  for (int j = 0; j < 6; j++) sum += (wide)span->basis[axis][j] * (wide)inner[j];
  return sum * (wide)span->scale[axis] / (wide)HEAD(block)->yard[axis];
}

/* The wrench on the yardstick, in weighted axes, that each force gives per newton. */
void fl_weigh_axes(const real *block, fl_work *work, const wide *weight) {
  for (int i = 0; i < COUNT(block); i++) {
    work->corners[i] = 0;
    for (int q = 0; q < 2; q++)
      for (int k = 0; k < 6; k++)
        work->column[i][q][k] = weight[k] * fl_out_of_range(block, work, work->span.matrix[i][q], k);
  }
}

/* The corner of a polygon, a count and pairs, that is worth most. */
static void best_corner(const real *polygon, const real *price, wide *force) {
  real most = -R(1e30);
  for (const real *at = polygon + 1, *end = at + 2 * (int)polygon[0]; at < end; at += 2)
    if (dot(price, at, 2) > most) most = dot(price, at, 2), force[0] = at[0], force[1] = at[1];
}

/* The point (6,), in weighted axes, that forces give. */
void fl_point_of_forces(const real *block, const fl_work *work, wide force[][2], wide *point) {
  memset(point, 0, sizeof work->column[0][0]);
  for (int i = 0; i < COUNT(block); i++)
    for (int q = 0; q < (int)ACTUATOR(block, i)->rows; q++) add(point, force[i][q], work->column[i][q]);
}

/* Puts the forces that are worth most at a normal (6,), and their point, behind the points of a mixture. */
static void farthest(const real *block, const fl_work *work, const wide *normal, fl_mixture *m) {
  wide(*force)[2] = m->force[m->count];
  for (int i = 0; i < COUNT(block); i++) {
    const wide *column = work->column[i][0];
    real own[2] = {(real)product(column, normal, 6), (real)product(column + 6, normal, 6)};
    if (work->corners[i] > 0)
      best_corner(block + work->corners[i], own, force[i]);
    else
      fl_support_of_set(block, i, work->set + i, own, force[i]);
  }
  fl_point_of_forces(block, work, force, m->point[m->count]);
  m->along[m->count] = work->ray && product(work->ray, normal, 6) < 0 ? 1 : 0;
  if (m->along[m->count] > 0) add(m->point[m->count], -1, work->ray);
}

static void drop(fl_mixture *m, int k) {
  m->count--, m->done = MIN(m->done, k);
  memmove(m->force + k, m->force + k + 1, (size_t)(m->count - k) * sizeof m->force[0]);
  memmove(m->point + k, m->point + k + 1, (size_t)(m->count - k) * sizeof m->point[0]);
  memmove(m->share + k, m->share + k + 1, (size_t)(m->count - k) * sizeof m->share[0]);
  memmove(m->along + k, m->along + k + 1, (size_t)(m->count - k) * sizeof m->along[0]);
}

static int least_share(const fl_mixture *m) {
  int least = 0;
  for (int k = 1; k < m->count; k++)
    if (m->share[k] < m->share[least]) least = k;
  return least;
}

/* Shares, which add up to 1, of the points that come nearest to a target; a point that depends on those before it
   gets 0. By Gram-Schmidt, again where little is left, as points near to each other are nearly dependent. */
static void affine(fl_mixture *m, const wide *target, wide *share) {
  wide right[FL_POINTS], rest[6];
  for (int j = MAX(m->done, 1); j < m->count; j++) {
    wide *q = m->q[j], *over = m->r[j] + j, size, left;
    memcpy(q, m->point[j], sizeof rest);
    add(q, -1, m->point[0]);
    for (int i = 1; i < j; i++) m->r[i][j] = 0;
    size = left = length_of(q);
    for (int twice = 0; twice < 2 && !(twice && left > 0.1 * size); twice++) {
      for (int i = 1; i < j; i++) {
        wide part = product(m->q[i], q, 6);
        m->r[i][j] += part;
        add(q, -part, m->q[i]);
      }
      left = length_of(q);
    }
    *over = left > BARELY * size ? 1 / left : 0;
    for (int k = 0; k < 6; k++) q[k] *= *over;
  }
  m->done = m->count;
  memcpy(rest, target, sizeof rest);
  add(rest, -1, m->point[0]);
  for (int j = 1; j < m->count; j++) {
    right[j] = product(m->q[j], rest, 6);
    add(rest, -right[j], m->q[j]);
  }
  share[0] = 1;
  for (int j = m->count - 1; j > 0; j--) {
    share[j] = m->r[j][j] * (right[j] - product(m->r[j] + j + 1, share + j + 1, m->count - j - 1));
    share[0] -= share[j];
  }
}

/* Shares of the points whose mixture is nearest to a target; points without a share are left out. */
static void mix(fl_mixture *m, const wide *target) {
  wide wanted[FL_POINTS];
  while (m->count > 1) {
    wide step = 1;
    int all = 1;
    affine(m, target, wanted);
    for (int k = 0; k < m->count; k++)
      if (wanted[k] <= BARELY) {
        all = 0;
        step = MIN(step, m->share[k] / MAX(m->share[k] - wanted[k], 1e-300));
      }
    if (all) {
      memcpy(m->share, wanted, sizeof wanted);
      return;
    }
    for (int k = 0; k < m->count; k++) m->share[k] += step * (wanted[k] - m->share[k]);
    m->share[least_share(m)] = 0;
    for (int k = m->count - 1; k >= 0; k--)
      if (m->share[k] <= BARELY) drop(m, k);
  }
  m->share[0] = 1;
}

/* Makes a mixture the point nearest to a target (6,); it begins at the mixture, where that has points. Up to the
   distance `close` a point is the nearest one; `apart` is the share of a miss to be proved. Where there is a miss,
   what is worth most across it follows the mixture's points. Returns the miss. */
wide fl_nearest_point(const real *block, const fl_work *work, const wide *target, wide close, wide apart, fl_mixture *m) {
  wide last = 1e300, way[6];
  if (m->count == 0) {
    farthest(block, work, target, m);
    m->count = 1, m->done = 0, m->share[0] = 1;
  }
  for (int k = 1;; k++) {
    memcpy(m->miss, target, sizeof m->miss);
    for (int p = 0; p < m->count; p++) add(m->miss, -m->share[p], m->point[p]);
    wide size = length_of(m->miss), gain;
    if (size <= close) return size;
    if (m->count == FL_POINTS) drop(m, least_share(m)); /* more than an affine basis */
    farthest(block, work, m->miss, m);
    memcpy(way, m->point[m->count], sizeof way);
    add(way, -1, target);
    add(way, 1, m->miss);
    gain = product(way, m->miss, 6);
    if (gain <= MAX(close, apart * size) * size || size >= last * (1 - BARELY) || k == MOST_POINTS) return size;
    last = size;
    m->share[m->count++] = 0;
    mix(m, target);
  }
}

/* The point of the set that is farthest along a ray (6,) from a point (6,), at sizes from `least` to `most`. A plane
   across the miss of a size bounds it from above, and is kept; the next try is that bound (Dinkelbach), until it
   is as `close`. Returns the bound; where no size is in the set, the least one, and the point is the nearest to it. */
wide fl_farthest_along_ray(const real *block, const fl_work *work, const wide *from, const wide *ray, wide least, wide most,
                    wide close, fl_mixture *m, wide *plane) {
  wide size = most, last = 1e300, target[6];
  memcpy(m->miss, ray, sizeof m->miss);
  m->count = m->done = 0, m->share[0] = 1;
  farthest(block, work, ray, m);
  for (int k = 0; k < MOST_SHARES; k++) {
    wide across = product(m->miss, ray, 6), bound = least;
    if (across > 0) bound = (product(m->point[m->count], m->miss, 6) - product(from, m->miss, 6)) / across;
    if (bound < size) size = MAX(bound, least), memcpy(plane, m->miss, sizeof m->miss);
    memcpy(target, from, sizeof target);
    add(target, size, ray);
    m->count = MAX(m->count, 1);
    wide miss = fl_nearest_point(block, work, target, close, 0.5, m);
    if (size == least || miss <= 2 * close || (size >= last && miss <= 1)) break;
    last = size >= last ? size - miss / (2 * length_of(ray)) : size;
    size = last;
  }
  return size;
}

void fl_mixed_forces(const real *block, const fl_mixture *m, real force[][2]) {
  for (int i = 0; i < COUNT(block); i++)
    for (int q = 0; q < 2; q++) {
      wide sum = 0;
      for (int p = 0; p < m->count; p++) sum += m->share[p] * m->force[p][i][q];
      force[i][q] = (real)sum;
    }
}
