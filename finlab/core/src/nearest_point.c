/* The point of a convex set nearest to another, and the farthest along a ray, by support
   functions alone.

   Wolfe's algorithm ("Finding the nearest point in a polytope", 1976): the nearest point is
   kept as a mixture of few points that are farthest along some normal, Eq. 12. Each step
   asks for the point that is farthest along the miss, and takes the nearest point of the
   affine hull of all, points whose share would fall below 0 left out. What the last point
   adds proves how far the mixture is from the nearest one. Sets with curved sides converge
   the same way. */
#include "internal.h"

#define MOST_POINTS 400
#define MOST_SHARES 60 /* shares of a ray that are tried, each a point nearest to it */
/* of a point's length, less than which is left: orthogonalized again */
#define NEARLY_DEPENDENT 0.1
#define PROOF_OF_SHARE 0.5 /* of a miss that is to be proved, for a plane across a ray */

/* One axis of a reduced wrench (6,) as a normalized wrench has it, over the wrench scale. */
wide fl_normalized_axis(const real *block, const fl_work *work, const real *reduced, int axis) {
  const fl_span *span = &work->span;
  wide sum = 0;
  for (int j = 0; j < 6; j++) sum += (wide)span->basis[axis][j] * (wide)reduced[j];
  return sum * (wide)span->axis_scale[axis] / (wide)HEAD(block)->wrench_scale[axis];
}

/* Sets the wrench over the wrench scale, in weighted axes, that each force gives per newton. */
void fl_weigh_axes(const real *block, fl_work *work, const wide *weight) {
  memcpy(work->axis_weight, weight, sizeof work->axis_weight);
  for (int i = 0; i < COUNT(block); i++) {
    work->polygon_offset[i] = 0;
    memset(work->effectiveness_weighted[i][1], 0, sizeof work->effectiveness_weighted[i][1]);
    for (int q = 0; q < (int)ACTUATOR(block, i)->rows; q++) {
      const real *row = work->span.effectiveness_reduced[i][q];
      for (int k = 0; k < 6; k++) {
        work->effectiveness_weighted[i][q][k] = weight[k] * fl_normalized_axis(block, work, row, k);
      }
    }
  }
}

/* The corner of a polygon, a count and pairs, that is farthest along prices s. */
static void farthest_corner(const real *polygon, const real *s, wide *force) {
  const int count = (int)polygon[0];
  real farthest = -LARGEST_NUMBER;
  for (int k = 0; k < count; k++) {
    const real *corner = polygon + 1 + 2 * k;
    const real distance = dot(s, corner, 2);
    if (!(distance > farthest)) continue;
    farthest = distance;
    force[0] = corner[0];
    force[1] = corner[1];
  }
}

/* The point (6,), in weighted axes, that forces give. */
void fl_point_of_forces(const real *block, const fl_work *work, wide force[][2], wide *point) {
  memset(point, 0, sizeof work->effectiveness_weighted[0][0]);
  for (int i = 0; i < COUNT(block); i++) {
    for (int q = 0; q < (int)ACTUATOR(block, i)->rows; q++) {
      add_scaled(point, force[i][q], work->effectiveness_weighted[i][q]);
    }
  }
}

/* The forces that are farthest along a normal (6,), in weighted axes. */
static void farthest_forces(const real *block, const fl_work *work, const wide *normal,
                            wide force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    const wide(*column)[6] = work->effectiveness_weighted[i];
    if (ACTUATOR(block, i)->rows == 1) {
      /* Chosen by index: which end it is, no processor can foresee. */
      const real ends[2] = {work->set[i].force_min, work->set[i].force_max};
      force[i][0] = ends[dot_wide(column[0], normal, 6) > 0];
      force[i][1] = 0;
      continue;
    }
    const real s[2] = {(real)dot_wide(column[0], normal, 6), (real)dot_wide(column[1], normal, 6)};
    if (work->polygon_offset[i] > 0)
      farthest_corner(block + work->polygon_offset[i], s, force[i]);
    else
      fl_support_of_set(block, i, work->set + i, s, force[i], 0);
  }
}

/* Puts the forces that are farthest along a normal (6,), and their point, behind the points
   of a mixture. Of a ray, where there is one, all is taken where that is farther. */
static void append_farthest(const real *block, const fl_work *work, const wide *normal,
                            fl_mixture *m) {
  const int last = m->count;
  wide(*force)[2] = m->force[last];
  m->actuators = COUNT(block);
#ifdef FL_WITH_POWER_SETS
  if (work->power_sets)
    fl_farthest_within_budgets(work->power_sets, COUNT(block), normal, force);
  else
#endif
    farthest_forces(block, work, normal, force);
  fl_point_of_forces(block, work, force, m->point[last]);
  m->ray_share[last] = 0;
  if (work->ray && dot_wide(work->ray, normal, 6) < 0) {
    m->ray_share[last] = 1;
    add_scaled(m->point[last], -1, work->ray);
  }
}

/* Takes point k out of a mixture. */
static void drop(fl_mixture *m, int k) {
  m->count--;
  if (m->basis_count > k) m->basis_count = k;
  const size_t behind = (size_t)(m->count - k);
  for (int p = k; p < m->count; p++) {
    memcpy(m->force[p], m->force[p + 1], (size_t)m->actuators * sizeof m->force[0][0]);
  }
  memmove(m->point + k, m->point + k + 1, behind * sizeof m->point[0]);
  memmove(m->weight + k, m->weight + k + 1, behind * sizeof m->weight[0]);
  memmove(m->ray_share + k, m->ray_share + k + 1, behind * sizeof m->ray_share[0]);
}

static int least_share(const fl_mixture *m) {
  int least = 0;
  for (int k = 1; k < m->count; k++) {
    if (m->weight[k] < m->weight[least]) least = k;
  }
  return least;
}

/* Takes from vector j of the basis what lies along those before it; what is left of its length. */
static wide orthogonalize(fl_mixture *m, int j) {
  for (int i = 1; i < j; i++) {
    const wide along = dot_wide(m->q[i], m->q[j], 6);
    m->r[i][j] += along;
    add_scaled(m->q[j], -along, m->q[i]);
  }
  return norm_wide(m->q[j]);
}

/* Extends the basis of a mixture by the difference of point j from the first one: by
   Gram-Schmidt, again where little is left, as points near to each other are nearly
   dependent. */
static void extend_basis(fl_mixture *m, int j) {
  wide *q = m->q[j];
  memcpy(q, m->point[j], sizeof m->q[j]);
  add_scaled(q, -1, m->point[0]);
  for (int i = 1; i < j; i++) m->r[i][j] = 0;
  const wide size = norm_wide(q);
  wide left = orthogonalize(m, j);
  if (!(left > NEARLY_DEPENDENT * size)) left = orthogonalize(m, j);
  wide inverse = 0;
  if (left > BARELY * size) inverse = 1 / left;
  m->r[j][j] = inverse;
  for (int k = 0; k < 6; k++) q[k] *= inverse;
}

/* Shares, which add up to 1, of the points that come nearest to a target, within their
   affine hull; a point that depends on those before it gets 0. */
static void affine_shares(fl_mixture *m, const wide *target_weighted, wide *share) {
  int begin = m->basis_count;
  if (begin < 1) begin = 1;
  for (int j = begin; j < m->count; j++) extend_basis(m, j);
  m->basis_count = m->count;

  wide right[FL_POINTS];
  wide left[6];
  memcpy(left, target_weighted, sizeof left);
  add_scaled(left, -1, m->point[0]);
  for (int j = 1; j < m->count; j++) {
    right[j] = dot_wide(m->q[j], left, 6);
    add_scaled(left, -right[j], m->q[j]);
  }
  share[0] = 1;
  for (int j = m->count - 1; j > 0; j--) {
    const wide behind = dot_wide(m->r[j] + j + 1, share + j + 1, m->count - j - 1);
    share[j] = m->r[j][j] * (right[j] - behind);
    share[0] -= share[j];
  }
}

/* How far shares may go towards wanted ones until the first is 0; 1 where none is to be left
   out. */
static wide step_to_edge(const fl_mixture *m, const wide *wanted, int *is_inside) {
  wide step = 1;
  *is_inside = 1;
  for (int k = 0; k < m->count; k++) {
    if (!(wanted[k] <= BARELY)) continue;
    *is_inside = 0;
    const wide to_edge = m->weight[k] / larger_wide(m->weight[k] - wanted[k], TINY_WIDE);
    if (!(step < to_edge)) step = to_edge;
  }
  return step;
}

/* Shares of the points whose mixture is nearest to a target; points without a share are left
   out. */
static void mix(fl_mixture *m, const wide *target_weighted) {
  while (m->count > 1) {
    wide wanted[FL_POINTS];
    int is_inside;
    affine_shares(m, target_weighted, wanted);
    const wide step = step_to_edge(m, wanted, &is_inside);
    if (is_inside) {
      memcpy(m->weight, wanted, sizeof wanted);
      return;
    }
    for (int k = 0; k < m->count; k++) m->weight[k] += step * (wanted[k] - m->weight[k]);
    m->weight[least_share(m)] = 0;
    for (int k = m->count - 1; k >= 0; k--) {
      if (m->weight[k] <= BARELY) drop(m, k);
    }
  }
  m->weight[0] = 1;
}

/* Sets the miss of a mixture: the way from its point to a target. Its length. */
static wide find_miss(fl_mixture *m, const wide *target_weighted) {
  memcpy(m->miss, target_weighted, sizeof m->miss);
  for (int p = 0; p < m->count; p++) add_scaled(m->miss, -m->weight[p], m->point[p]);
  return norm_wide(m->miss);
}

/* What the point behind those of a mixture lies beyond the mixture along the miss, over no
   length. */
static wide gain_of_last(const fl_mixture *m, const wide *target_weighted) {
  wide way[6];
  memcpy(way, m->point[m->count], sizeof way);
  add_scaled(way, -1, target_weighted);
  add_scaled(way, 1, m->miss);
  return dot_wide(way, m->miss, 6);
}

/* Makes a mixture the point nearest to a target (6,); it begins at the mixture, where that
   has points. Up to the distance `close` a point is the nearest one; `apart` is the share of
   a miss to be proved. Where there is a miss, what is farthest along it follows the
   mixture's points. Returns the miss. */
wide fl_nearest_point(const real *block, const fl_work *work, const wide *target_weighted,
                      wide close, wide apart, fl_mixture *m) {
  wide last_miss = 1e300;
  if (m->count == 0) {
    append_farthest(block, work, target_weighted, m);
    m->count = 1;
    m->basis_count = 0;
    m->weight[0] = 1;
  }
  for (int k = 1;; k++) {
    const wide miss = find_miss(m, target_weighted);
    if (miss <= close) return miss;
    if (m->count == FL_POINTS) drop(m, least_share(m)); /* more than an affine basis */
    append_farthest(block, work, m->miss, m);
    const wide gain = gain_of_last(m, target_weighted);
    const int is_proved = gain <= larger_wide(close, apart * miss) * miss;
    const int has_stalled = miss >= last_miss * (1 - BARELY);
    if (is_proved || has_stalled || k == MOST_POINTS) return miss;
    last_miss = miss;
    m->weight[m->count] = 0;
    m->count++;
    mix(m, target_weighted);
  }
}

/* The point of the set that is farthest along a ray (6,) from a point (6,), at sizes from
   `least` to `most`. A plane across the miss of a size bounds it from above, and is kept;
   the next try is that bound (Dinkelbach), until it is as `close`. It begins at the mixture and
   the normal m->miss, where that has points. Returns the bound, Eq. 14; where no size is in the
   set, the least one, and the point is the nearest to it. */
wide fl_farthest_along_ray(const real *block, const fl_work *work, const wide *from,
                           const wide *ray, wide least, wide most, wide close, fl_mixture *m,
                           wide *plane) {
  wide size = most;
  wide last_size = 1e300;
  if (m->count == 0) {
    memcpy(m->miss, ray, sizeof m->miss);
    m->basis_count = 0;
    m->weight[0] = 1;
  }
  append_farthest(block, work, m->miss, m);
  for (int k = 0; k < MOST_SHARES; k++) {
    const wide *normal = m->miss;
    const wide across = dot_wide(normal, ray, 6);
    wide bound = least;
    if (across > 0) {
      const wide *farthest = m->point[m->count];
      bound = (dot_wide(farthest, normal, 6) - dot_wide(from, normal, 6)) / across;
    }
    if (bound < size) {
      size = larger_wide(bound, least);
      memcpy(plane, normal, sizeof m->miss);
    }
    wide target_weighted[6];
    memcpy(target_weighted, from, sizeof target_weighted);
    add_scaled(target_weighted, size, ray);
    if (m->count < 1) m->count = 1;
    const wide miss = fl_nearest_point(block, work, target_weighted, close, PROOF_OF_SHARE, m);
    const int has_stalled = size >= last_size;
    if (size == least || miss <= 2 * close || (has_stalled && miss <= 1)) break;
    if (has_stalled) size -= miss / (2 * norm_wide(ray));
    last_size = size;
  }
  return size;
}

/* The forces of a mixture: those of its points by their shares. */
void fl_mixed_forces(const real *block, const fl_mixture *m, real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    for (int q = 0; q < 2; q++) {
      wide sum = 0;
      for (int p = 0; p < m->count; p++) sum += m->weight[p] * m->force[p][i][q];
      force[i][q] = (real)sum;
    }
  }
}
