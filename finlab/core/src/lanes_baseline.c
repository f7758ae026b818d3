/* Lanes of what every processor of a kind has: vectors of two numbers, by SSE2 or NEON. */
#include "lanes.h"

#ifdef HAS_LANES
#define LANES LANES_BASELINE
#include "lanes_vector.h"

static inline vector select_lanes(mask m, vector yes, vector no) {
  return (vector)((m & (mask)yes) | (~m & (mask)no));
}

static inline vector root_of(vector x) {
  vector root = {0};
  for (int l = 0; l < LANES; l++) root[l] = sqrt(x[l]);
  return root;
}

static inline vector larger_of(vector a, vector b) { return select_lanes(a > b, a, b); }

static inline vector smaller_of(vector a, vector b) { return select_lanes(a < b, a, b); }

/* A bit for each lane, that of the first one the lowest. */
static inline int bits_of(mask m) { return (int)(-m[0] - 2 * m[1]); }

/* Four numbers in a row for each lane, from its index on. */
static inline void gather_four(const real *numbers, mask index, vector *gathered) {
  for (int k = 0; k < 4; k++) gathered[k] = gather(numbers + k, index);
}

#include "lanes_kernel.h"
#include "interaction_kernel.h"

void fl_lanes_baseline(const lanes_robot *robot, const lanes_batch *batch) {
  answer_in_lanes(robot, batch);
}

void fl_interaction_baseline(const interaction_model *model, const real *force,
                             interaction_effect *effect) {
  add_interaction(model, force, effect);
}
#endif
