/* How far rays go in the attainable set of robots that Python describes by sets of forces alone,
   for finlab/core/ray_reach.py. The method itself, Eqs. 12 and 14, is in nearest_point.c. */
#include "internal.h"

#define NUMBERS_OF_SET 16 /* of each actuator, in `sets` of fl_reach */

/* Takes the set of one actuator from its numbers: offset of a polygon's corners, or 0 and
   radius, centre and half angle of a sector; then the wrench per newton along both directions. */
static void take_set(const real *block, fl_work *work, int i, const real *numbers) {
  const real *columns = numbers + 4;
  fl_set *set = work->set + i;
  memset(set, 0, sizeof *set);
  set->force_max = numbers[1];
  set->sector_center = numbers[2];
  set->sector_half_angle = numbers[3];
  work->polygon_offset[i] = (int)numbers[0];
  fl_prepare_set(block, i, set);
  memcpy(work->effectiveness_weighted[i], columns, sizeof work->effectiveness_weighted[i]);
}

/* Of `count` robots of n actuators in planes, which a block counts and no more, how far
   (count,) a ray (count, 6) from a point (count, 6) goes in what they push: a bound that is
   as `close`, the normal (count, 6) of its plane, and the forces (count, n, 2) there. Their
   sets are given (count, n, 16), see take_set. */
void fl_reach(const real *block, fl_work *work, const real *sets, const wide *from, const wide *ray,
              int count, wide close, wide *size, wide *normal, real *force) {
  const int n = COUNT(block);
  const wide farthest = 1e30;
  for (int k = 0; k < count; k++) {
    for (int i = 0; i < n; i++) take_set(block, work, i, sets + NUMBERS_OF_SET * i);
    work->mixture.count = 0;
    size[k] = fl_farthest_along_ray(block, work, from, ray, -farthest, farthest, close,
                                    &work->mixture, normal);
    fl_mixed_forces(block, &work->mixture, (real(*)[2])force);
    sets += NUMBERS_OF_SET * n;
    from += 6;
    ray += 6;
    normal += 6;
    force += 2 * n;
  }
}

#ifdef FL_WITH_POWER_SETS
/* Makes a mixture the forces that are farthest along the normal of a smooth set. */
static void begin_at_normal(const real *block, fl_work *work, const wide *from, const wide *ray,
                            wide close, fl_mixture *m) {
  fl_smooth_normal(block, work, from, ray, close, m->miss);
  fl_farthest_within_budgets(work->power_sets, COUNT(block), m->miss, m->force[0]);
  fl_point_of_forces(block, work, m->force[0], m->point[0]);
  m->actuators = COUNT(block);
  m->count = 1;
  m->basis_count = 0;
  m->weight[0] = 1;
  m->ray_share[0] = 0;
}

/* The same within power budgets of buses, by sides of sets (fl_power_side) and their powers; and
   the multipliers (count, buses) of the budgets at the planes. `corners` has a number for each
   side, 0 at first, to be used by this function alone. */
void fl_reach_within(const real *block, fl_work *work, const real *tables, const real *sides,
                     const real *budget, int buses, const real *sets, const wide *from,
                     const wide *ray, int count, wide close, int *corners, wide *size, wide *normal,
                     real *force, wide *multiplier) {
  const int n = COUNT(block);
  const wide farthest = 1e30;
  fl_power_sets power_sets;
  memset(&power_sets, 0, sizeof power_sets);
  power_sets.tables = tables;
  power_sets.side = (const fl_power_side *)sides;
  power_sets.budget = budget;
  power_sets.buses = buses;
  power_sets.corner = corners;
  work->power_sets = &power_sets;
  for (int k = 0; k < count; k++) {
    power_sets.actuator = sets;
    for (int i = 0; i < n; i++) {
      const real *columns = sets + NUMBERS_OF_ACTUATOR * i + 4;
      memcpy(work->effectiveness_weighted[i], columns, sizeof work->effectiveness_weighted[i]);
    }
    memset(power_sets.expected, 0, sizeof power_sets.expected);
    work->mixture.count = 0;
    if (close < farthest) begin_at_normal(block, work, from, ray, close, &work->mixture);
    size[k] = fl_farthest_along_ray(block, work, from, ray, -farthest, farthest, close,
                                    &work->mixture, normal);
    fl_mixed_forces(block, &work->mixture, (real(*)[2])force);
    wide unused[FL_MOST][2];
    fl_farthest_within_budgets(&power_sets, n, normal, unused);
    memcpy(multiplier, power_sets.multiplier, (size_t)buses * sizeof *multiplier);
    sets += NUMBERS_OF_ACTUATOR * n;
    from += 6;
    ray += 6;
    normal += 6;
    force += 2 * n;
    multiplier += buses;
  }
  work->power_sets = 0;
}
#endif
