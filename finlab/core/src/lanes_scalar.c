/* Lanes of one number: for compilers without vectors, and in single precision. */
#include "lanes.h"

#define LANES 1
#include "lanes_vector.h"
#include "interaction_kernel.h"

void fl_interaction_scalar(const interaction_model *model, const real *force,
                           interaction_effect *effect) {
  add_interaction(model, force, effect);
}
