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
