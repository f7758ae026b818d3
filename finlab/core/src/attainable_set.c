#include "internal.h"

/* Of `count` robots of n actuators in planes, which a block counts and no more, how far (count,) a ray (count, 6)
   from a point (count, 6) goes in what they push: a bound that is as `close`, the normal (count, 6) of its plane, and
   the forces (count, n, 2) there. Their sets are given (count, n, 16): place of a polygon's corners, or 0 and radius,
   middle, half of a sector; then the wrench per newton along both directions. */
void fl_reach(const real *block, fl_work *work, const real *own, const wide *from, const wide *ray, int count,
              wide close, wide *size, wide *normal, real *force) {
  for (int k = 0; k < count; k++, from += 6, ray += 6, normal += 6, force += 2 * COUNT(block)) {
    for (int i = 0; i < COUNT(block); i++, own += 16) {
      work->set[i] = (fl_set){.high = own[1], .middle = own[2], .half = own[3]};
      work->corners[i] = (int)own[0];
      fl_prepare_set(block, i, work->set + i);
      memcpy(work->column[i], own + 4, sizeof work->column[i]);
    }
    size[k] = fl_farthest_along_ray(block, work, from, ray, -1e30, 1e30, close, &work->mixture, normal);
    fl_mixed_forces(block, &work->mixture, (real(*)[2])force);
  }
}
