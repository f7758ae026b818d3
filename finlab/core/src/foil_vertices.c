/* Where searches begin for commands of foils whose drag is welcome.

   The dual leaves such foils between the ends of their lift, on the chord of their curve, and
   mostly there are many such lifts for the same wrench: two foils of the same effect may share
   theirs as they like. On the curve itself drag is largest at the ends. So foils are moved along
   directions in lift that no wrench feels, or that other actuators make up for, until as many as
   can be are at an end: vertices of the polytope of these lifts. Where there is no such direction,
   searches begin at the lifts of the dual, and with each of the foils at each of its ends. */
#include "internal.h"

#define SPANNED CLOSE /* share of a column that others leave, below which they span it */

/* Takes of a vector (6,) what orthogonal ones (count, 6) span. */
static void take_off(real orthogonal[][6], int count, real *vector) {
  for (int k = 0; k < count; k++) {
    const real *other = orthogonal[k];
    const real share = dot(other, vector, 6) / dot(other, other, 6);
    for (int j = 0; j < 6; j++) vector[j] -= share * other[j];
  }
}

/* Whether so little of a column (6,) is left that others span it. */
static int is_spanned(const real *left, real size) {
  return dot(left, left, 6) <= SPANNED * SPANNED * size * size;
}

/* Wrench in the basis by the lift of a foil along the chord of its curve. */
static void column_of(const real *block, const fl_work *work, int i, real *column) {
  const fl_set *set = work->set + i;
  const real(*B)[6] = work->span.effectiveness_reduced[i];
  const real range = larger(set->force_max - set->force_min, TINY);
  const real power_slope = (set->cost_at_max - set->cost_at_min) / range;
  const real drag_slope = power_slope / ACTUATOR(block, i)->flow_speed;
  for (int j = 0; j < 6; j++) column[j] = B[0][j] + drag_slope * B[1][j];
}

/* Orthogonal columns (6, 6) that span what other actuators make up for, those whose forces still
   move; how many there are. */
static int span_others(const real *block, const fl_work *work, const foil_vertices *vertices,
                       real orthogonal[6][6]) {
  const fl_state *state = work->state_found;
  unsigned char is_between[FL_MOST] = {0};
  for (int f = 0; f < vertices->foils; f++) is_between[vertices->foil[f]] = 1;
  int count = 0;
  for (int i = 0; i < COUNT(block); i++) {
    if (is_between[i] || work->span.is_lost[i]) continue;
    int rows = (int)ACTUATOR(block, i)->rows;
    if (is_foil(ACTUATOR(block, i))) rows = 1;
    for (int row = 0; row < rows && count < 6; row++) {
      const int moves = state->dy_ds[i][2 * row] > 0;
      real *column = orthogonal[count];
      memcpy(column, work->span.effectiveness_reduced[i][row], sizeof orthogonal[count]);
      const real size = SQRT(dot(column, column, 6));
      take_off(orthogonal, count, column);
      if (moves && !is_spanned(column, size)) count++;
    }
  }
  return count;
}

/* A direction (foils,) in the lifts of foils that are not held at an end, which others make up for;
   0 where there is none. By Gram and Schmidt: the first column that those before it span. */
static int find_direction(const foil_vertices *vertices, const unsigned char *is_held,
                          real *direction) {
  real orthogonal[VERTEX_FOILS][6];
  real made_of[VERTEX_FOILS][VERTEX_FOILS]; /* of each: shares of columns */
  int count = 0;
  for (int f = 0; f < vertices->foils; f++) {
    if (is_held[f]) continue;
    real *left = orthogonal[count];
    real *share = made_of[count];
    memcpy(left, vertices->column[f], sizeof orthogonal[count]);
    memset(share, 0, sizeof made_of[count]);
    share[f] = 1;
    for (int k = 0; k < count; k++) {
      const real *other = orthogonal[k];
      const real part = dot(other, left, 6) / dot(other, other, 6);
      for (int j = 0; j < 6; j++) left[j] -= part * other[j];
      for (int g = 0; g < vertices->foils; g++) share[g] -= part * made_of[k][g];
    }
    if (is_spanned(left, vertices->size[f])) {
      memcpy(direction, share, sizeof made_of[count]);
      return 1;
    }
    count++;
  }
  return 0;
}

/* Moves lifts in `force` (n, 2) along a direction until the first of them is at an end, where its
   foil is held. */
static void move_to_end(const fl_work *work, const foil_vertices *vertices, const real *direction,
                        unsigned char *is_held, real force[][2]) {
  real shortest = LARGEST_NUMBER;
  real end_of_first = 0;
  int first = 0;
  for (int f = 0; f < vertices->foils; f++) {
    const int i = vertices->foil[f];
    if (is_held[f] || direction[f] == 0) continue;
    real end = work->set[i].force_min;
    if (direction[f] > 0) end = work->set[i].force_max;
    const real length = (end - force[i][0]) / direction[f];
    if (!(length < shortest)) continue;
    shortest = length;
    end_of_first = end;
    first = f;
  }
  for (int f = 0; f < vertices->foils; f++) {
    if (!is_held[f]) force[vertices->foil[f]][0] += shortest * direction[f];
  }
  force[vertices->foil[first]][0] = end_of_first;
  is_held[first] = 1;
}

/* How many directions lifts can be moved along one after the other: each holds one foil. */
static int count_directions(const foil_vertices *vertices) {
  unsigned char is_held[VERTEX_FOILS] = {0};
  real direction[VERTEX_FOILS];
  int directions = 0;
  while (find_direction(vertices, is_held, direction)) {
    int first = 0;
    while (direction[first] == 0) first++;
    is_held[first] = 1;
    directions++;
  }
  return directions;
}

/* Finds the foils that work->state_found leaves between their ends, and at how many vertices of
   their lifts searches begin. */
void fl_find_vertices(const real *block, const fl_work *work, foil_vertices *vertices) {
  const fl_state *state = work->state_found;
  const real largest = fl_largest_force(block, work->state_found->force);
  real orthogonal[6][6];
  vertices->foils = 0;
  for (int i = 0; i < COUNT(block) && vertices->foils < VERTEX_FOILS; i++) {
    if (!is_foil(ACTUATOR(block, i)) || work->span.is_lost[i]) continue;
    const real gap = fl_gap_of(block, work, i, state->force[i], largest, state->lambda_reduced);
    if (!(gap > 0)) continue;
    vertices->foil[vertices->foils] = i;
    vertices->foils++;
  }
  const int count = span_others(block, work, vertices, orthogonal);
  for (int f = 0; f < vertices->foils; f++) {
    real *column = vertices->column[f];
    column_of(block, work, vertices->foil[f], column);
    vertices->size[f] = SQRT(dot(column, column, 6));
    take_off(orthogonal, count, column);
  }
  vertices->directions = count_directions(vertices);
  vertices->count = 1 + 2 * vertices->foils;
  if (vertices->directions > 0) vertices->count = 1 << vertices->directions;
}

/* Makes lifts in `force` (n, 2), those of the dual, the lifts of a vertex. Its bits say which way
   each direction is gone; without directions the first vertex is the lifts as they are, and the
   others have one foil at an end. Marks which of the foils are held at an end. */
void fl_go_to_vertex(const fl_work *work, const foil_vertices *vertices, int vertex,
                     unsigned char *is_held, real force[][2]) {
  real direction[VERTEX_FOILS] = {0};
  memset(is_held, 0, VERTEX_FOILS);
  if (vertices->directions == 0 && vertex > 0) {
    direction[(vertex - 1) / 2] = 1;
    if (vertex % 2) direction[(vertex - 1) / 2] = -1;
    move_to_end(work, vertices, direction, is_held, force);
  }
  for (int k = 0; k < vertices->directions; k++) {
    if (!find_direction(vertices, is_held, direction)) return;
    if (vertex >> k & 1) {
      for (int f = 0; f < vertices->foils; f++) direction[f] = -direction[f];
    }
    move_to_end(work, vertices, direction, is_held, force);
  }
}
