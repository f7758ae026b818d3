/* What jets and messages take of the forces of one robot, by the kernel of as many lanes as its
   numbers say. */
#include "interaction_lanes.h"

void fl_begin_effect(int n, real *slope, interaction_effect *effect) {
  memset(effect->change, 0, (size_t)n * sizeof effect->change[0]);
  memset(effect->by_own, 0, (size_t)n * sizeof effect->by_own[0]);
  if (slope) memset(slope, 0, 18 * (size_t)n * sizeof *slope);
  effect->slope = (real(*)[3][6])slope;
}

void fl_add_model(const interaction_model *model, const real *force, interaction_effect *effect) {
  const int lanes = (int)model->formula[0]->lanes;
  interaction_kernel kernel = fl_interaction_scalar;
#ifdef HAS_LANES
  if (lanes == LANES_BASELINE) kernel = fl_interaction_baseline;
#endif
#ifdef HAS_X86_LANES
  if (lanes == LANES_AVX2) kernel = fl_interaction_avx2;
  if (lanes == LANES_AVX512) kernel = fl_interaction_avx512;
#endif
  (void)lanes; /* in single precision there are none */
  kernel(model, force, effect);
}

void fl_finish_effect(const water *w, interaction_effect *effect, real *change, real *offset) {
  const outlet *outlets = outlets_of(w);
  memcpy(change, effect->change, (size_t)w->n * sizeof effect->change[0]);
  memset(offset, 0, 6 * sizeof *offset);
  for (int i = 0; i < (int)w->n; i++) {
    const real *position = outlets[i].position;
    add_wrench(position, effect->change[i], offset);
    for (int c = 0; c < 3 && effect->slope; c++) {
      add_wrench(position, effect->by_own[i][c], effect->slope[i][c]);
    }
  }
}
