/* Where the dual leaves foils between the ends of their lift, what they give is between their curve
   and its chord, and mostly there are many such forces for the same wrench: two foils of the same
   effect may share their lift as they like. On the curves drag is largest at the ends. So the foils
   are moved along directions in lift that no wrench feels until as many as can be are at an end:
   the vertices of the polytope of these lifts, of which each is where a search may begin. */
#include "internal.h"

#define NO_EFFECT NEARLY /* share of a column that is left by others, below which it is theirs */

/* Wrench in the basis by the lift of a foil along its chord. */
static void column_of(const fl_work *work, int i, real *column) {
  const fl_set *set = work->set + i;
  const real(*B)[6] = work->span.effectiveness_reduced[i];
  const real range = larger(set->force_max - set->force_min, TINY);
  const real drag_slope = (set->cost_at_max - set->cost_at_min) / range;
  for (int j = 0; j < 6; j++) column[j] = B[0][j] + drag_slope * B[1][j];
}

/* Takes of a column what orthogonal ones (count, 6) span. */
static void take_off(const real q[][6], int count, real *column) {
  for (int k = 0; k < count; k++) {
    const real share = dot(q[k], column, 6) / dot(q[k], q[k], 6);
    for (int j = 0; j < 6; j++) column[j] -= share * q[k][j];
  }
}

/* Orthogonal columns (6, 6) that span what actuators make up for whose forces still move; how many
   there are. */
static int span_of_others(const real *block, const fl_work *work, const foil_vertices *vertices,
                          real q[][6]) {
  const fl_state *state = work->state_found;
  int count = 0;
  for (int i = 0; i < COUNT(block); i++) {
    int is_between = 0;
    for (int f = 0; f < vertices->foils; f++) is_between |= vertices->foil[f] == i;
    if (is_between || work->span.is_lost[i]) continue;
    int rows = (int)ACTUATOR(block, i)->rows;
    if (is_foil(ACTUATOR(block, i))) rows = 1;
    for (int row = 0; row < rows && count < 6; row++) {
      if (!(state->dy_ds[i][2 * row] > 0)) continue;
      const real *B = work->span.effectiveness_reduced[i][row];
      real rest[6];
      memcpy(rest, B, sizeof rest);
      take_off((const real(*)[6])q, count, rest);
      if (dot(rest, rest, 6) <= NO_EFFECT * NO_EFFECT * dot(B, B, 6)) continue;
      memcpy(q[count], rest, sizeof rest);
      count++;
    }
  }
  return count;
}

void fl_find_vertices(const real *block, const fl_work *work, foil_vertices *vertices) {
  const fl_state *state = work->state_found;
  real q[6][6];
  vertices->foils = 0;
  for (int i = 0; i < COUNT(block) && vertices->foils < VERTEX_FOILS; i++) {
    if (!is_foil(ACTUATOR(block, i)) || work->span.is_lost[i]) continue;
    if (!(fl_gap_of(block, work, i, state->force[i], 1, state->lambda_reduced) > 0)) continue;
    vertices->foil[vertices->foils] = i;
    column_of(work, i, vertices->column[vertices->foils]);
    vertices->foils++;
  }
  const int count = span_of_others(block, work, vertices, q);
  for (int f = 0; f < vertices->foils; f++) {
    real *column = vertices->column[f];
    vertices->size[f] = SQRT(dot(column, column, 6));
    take_off((const real(*)[6])q, count, column);
  }
}

/* A direction (foils,) in the lifts of the foils that are not at an end, along which the wrench
   stays; 0 where there is none. Gram and Schmidt: the first column that those before it span. */
static int unfelt_direction(const foil_vertices *vertices, const unsigned char *is_at_end,
                            real *direction) {
  real q[VERTEX_FOILS][6];            /* orthogonal columns */
  real by[VERTEX_FOILS][VERTEX_FOILS]; /* of which columns they are made */
  int known[VERTEX_FOILS];
  int count = 0;
  for (int f = 0; f < vertices->foils; f++) {
    if (is_at_end[f]) continue;
    const real *column = vertices->column[f];
    real rest[6];
    real made[VERTEX_FOILS] = {0};
    memcpy(rest, column, sizeof rest);
    made[f] = 1;
    for (int k = 0; k < count; k++) {
      const real *other = q[known[k]];
      const real share = dot(other, rest, 6) / dot(other, other, 6);
      for (int j = 0; j < 6; j++) rest[j] -= share * other[j];
      for (int g = 0; g < vertices->foils; g++) made[g] -= share * by[known[k]][g];
    }
    const real least = NO_EFFECT * vertices->size[f];
    if (dot(rest, rest, 6) <= least * least) {
      memcpy(direction, made, sizeof made);
      return 1;
    }
    memcpy(q[f], rest, sizeof rest);
    memcpy(by[f], made, sizeof made);
    known[count] = f;
    count++;
  }
  return 0;
}

/* Moves lifts along a direction until the first of them is at an end. */
static void move_to_end(const fl_work *work, const foil_vertices *vertices, const real *direction,
                        unsigned char *is_at_end, real force[][2]) {
  real shortest = LARGEST_NUMBER;
  int first = -1;
  real end_of_first = 0;
  for (int f = 0; f < vertices->foils; f++) {
    if (is_at_end[f] || direction[f] == 0) continue;
    const int i = vertices->foil[f];
    real end = work->set[i].force_min;
    if (direction[f] > 0) end = work->set[i].force_max;
    const real length = (end - force[i][0]) / direction[f];
    if (!(length < shortest)) continue;
    shortest = length;
    first = f;
    end_of_first = end;
  }
  if (first < 0) return;
  for (int f = 0; f < vertices->foils; f++) {
    if (!is_at_end[f]) force[vertices->foil[f]][0] += shortest * direction[f];
  }
  force[vertices->foil[first]][0] = end_of_first;
  is_at_end[first] = 1;
}

/* Makes lifts in `force` (n, 2), of the dual, those of a vertex, whose bits say which way each
   direction is gone. Marks which of the foils are at an end; returns how many directions there
   were. */
int fl_go_to_vertex(const fl_work *work, const foil_vertices *vertices, int vertex,
                    unsigned char *is_at_end, real force[][2]) {
  real direction[VERTEX_FOILS];
  int directions = 0;
  memset(is_at_end, 0, VERTEX_FOILS);
  while (unfelt_direction(vertices, is_at_end, direction)) {
    if (vertex >> directions & 1) {
      for (int f = 0; f < vertices->foils; f++) direction[f] = -direction[f];
    }
    move_to_end(work, vertices, direction, is_at_end, force);
    directions++;
  }
  return directions;
}
