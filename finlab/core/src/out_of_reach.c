/* What is given in place of a wrench out of reach: the nearest one, the same direction, or
   groups of axes.

   Each is the point of a convex set nearest to another, in axes in which what counts more is
   longer. `closest` takes the axes by their weights, `direction` the farthest share of the
   target, `priority` the axes of one group after the other, what those before it have got
   held, `falling` the nearest wrench that gives no more along some axes than was asked for,
   and nothing the other way. Sets with gaps are cut until the best answer of all lies in none. */
#include "internal.h"

#define REACH_PARTS 96     /* parts that a policy may look at, of any robot */
#define REACH_PARTS_ARC 64 /* the same, for each foil that may stall */
#define REACH_PARTS_EACH 8 /* the same, for each of its actuators */

/* Distance, over the wrench scale, up to which the point of a part is the nearest one. */
#define ROUGHLY (NEARLY / 10)
#define CLOSER_ROUNDS 24 /* of shorter arcs around angles of foils, at most */
#define HELD 1e3         /* weight of an axis that is held over one of the group that is served */
#define HOLDS 16         /* rounds that look for the axes at an end of what they may get */
#define TURNED (CLOSE / 10) /* pull at a held axis from which on it is let go */
#define PULL 2e-3 /* miss of a group for which held axes give way by a millionth at a curved rim */
/* Scaled wrench by which an answer at the rim may be off: what it gives is then what is served. */
#define AT_RIM (R(0.1) * NEARLY)

/* Which number of a score of FL_DIRECTION is the share of the wrench that is not given. */
enum { MISSING_RAY_SHARE = 1 };

/* Whether so many bytes are the same, one of which was copied from the other. Not memcmp:
   WebAssembly has no library. */
static int are_same(const void *one, const void *other, size_t size) {
  const unsigned char *a = one;
  const unsigned char *b = other;
  for (size_t k = 0; k < size; k++) {
    if (a[k] != b[k]) return 0;
  }
  return 1;
}

static real rounded(real value) { return FLOOR(value / NEARLY + R(0.5)) * NEARLY; }

static wide over_wrench_scale(const real *block, const real *wrench, int k) {
  return (wide)wrench[k] / (wide)HEAD(block)->wrench_scale[k];
}

/* Keeps a normal (6,) in weighted axes as that of the rim, in the basis. */
static void keep_normal(const real *block, fl_work *work, const wide *weight, const wide *normal) {
  const fl_span *span = &work->span;
  for (int j = 0; j < 6; j++) {
    wide sum = 0;
    for (int k = 0; k < 6; k++) {
      const wide scale = (wide)span->axis_scale[k] / (wide)HEAD(block)->wrench_scale[k];
      sum += (wide)span->basis[k][j] * scale * weight[k] * normal[k];
    }
    work->rim_normal[j] = (real)sum;
  }
}

/* The normal of the rim that was found last, in the weighted axes of now, where the prices of all
   are the same. */
static void take_normal(const real *block, const fl_work *work, wide *normal) {
  const fl_span *span = &work->span;
  for (int k = 0; k < 6; k++) {
    normal[k] = 0;
    if (!(work->axis_weight[k] > 0)) continue;
    const wide scale = (wide)span->axis_scale[k] / (wide)HEAD(block)->wrench_scale[k];
    for (int j = 0; j < 6; j++) {
      normal[k] += (wide)span->basis[k][j] * (wide)work->rim_normal[j] /
                   (scale * work->axis_weight[k]);
    }
  }
}

/* Makes work->mixture the point nearest to a target (6,) in weighted axes. Returns the miss. */
static wide nearest_point(const real *block, fl_work *work, const wide *target_weighted) {
  fl_mixture *m = &work->mixture;
  wide normal[6];
  take_normal(block, work, normal);
  work->is_rim_exact =
      fl_nearest_by_normal(block, work, target_weighted, normal, work->distance_enough, m) ||
      fl_has_lines_alone(block);
  return fl_nearest_point(block, work, target_weighted, work->distance_enough, 0, m);
}

/* Points of a mixture anew, in the axes that hold now. */
static void remake_points(const real *block, const fl_work *work, fl_mixture *m) {
  m->basis_count = 0;
  for (int p = 0; p < m->count; p++) fl_point_of_forces(block, work, m->force[p], m->point[p]);
}

/* Comes as near to a wrench over the wrench scale as weighted axes allow; `missing` becomes what
   the axes of a weight lack of it. Returns the miss in weighted axes. */
static wide serve_weighted(const real *block, fl_work *work, const wide *weight, const wide *wanted,
                           wide *missing) {
  fl_mixture *m = &work->mixture;
  wide target_weighted[6];
  for (int k = 0; k < 6; k++) target_weighted[k] = weight[k] * wanted[k];
  fl_weigh_axes(block, work, weight);
  remake_points(block, work, m);
  const wide miss = nearest_point(block, work, target_weighted);
  for (int k = 0; k < 6; k++) {
    missing[k] = 0;
    if (weight[k] > 0) missing[k] = m->miss[k] / weight[k];
  }
  return miss;
}

static void serve_closest(const real *block, fl_work *work, const wide *wanted,
                          const fl_policy *policy, real *score) {
  wide weight[6];
  wide missing[6];
  for (int k = 0; k < 6; k++) weight[k] = larger(policy->axis_weight[k], CLOSE);
  score[0] = rounded((real)serve_weighted(block, work, weight, wanted, missing));
  keep_normal(block, work, weight, work->mixture.miss);
}

/* The ray of a wrench, over the wrench scale, within the range of the effectiveness. */
static void ray_of(const real *block, const fl_work *work, const real *wrench, wide *ray) {
  real along[6];
  real target_reduced[6];
  for (int k = 0; k < 6; k++) along[k] = wrench[k] + work->span.wrench_offset[k];
  fl_reduce_wrench(work, along, target_reduced);
  const int is_in_range = fl_is_in_range(work, along, target_reduced);
  for (int k = 0; k < 6; k++) {
    ray[k] = 0;
    /* What rounding has put beside the range is left out. */
    if (is_in_range) ray[k] = fl_normalized_axis(block, work, target_reduced, k);
  }
}

/* The point nearest to any share t of a ray, from 0 to 1, Eq. 15. Returns the share. */
static wide nearest_to_ray(const real *block, fl_work *work, const wide *from, const wide *ray,
                           real *score) {
  fl_mixture *m = &work->mixture;
  m->count = 0;
  work->ray = ray;
  const wide miss = fl_nearest_point(block, work, from, work->distance_enough, 0, m);
  work->ray = 0;
  score[0] = rounded((real)miss);
  wide ray_share = 0;
  for (int p = 0; p < m->count; p++) ray_share += m->weight[p] * m->ray_share[p];
  return ray_share;
}

/* The largest share of a wrench that can be given alone, Eq. 14. In a tick there may be
   none, as drives cannot stop or turn at once: then what is nearest to any share, Eq. 15. */
static void serve_direction(const real *block, fl_work *work, const real *wrench, real *score) {
  fl_mixture *m = &work->mixture;
  const wide weight[6] = {1, 1, 1, 1, 1, 1};
  wide from[6];
  wide ray[6];
  wide plane[6] = {0};
  for (int k = 0; k < 6; k++) from[k] = -over_wrench_scale(block, work->span.wrench_offset, k);
  ray_of(block, work, wrench, ray);
  fl_weigh_axes(block, work, weight);
  wide normal[6];
  take_normal(block, work, normal);
  m->count = 0;
  work->is_rim_exact =
      fl_end_of_ray_by_normal(block, work, from, ray, normal, work->distance_enough, m) ||
      fl_has_lines_alone(block);
  wide ray_share =
      fl_farthest_along_ray(block, work, from, ray, 0, 1, work->distance_enough, m, plane);
  keep_normal(block, work, weight, plane);
  /* What misses along the ray is a smaller share; what is across it counts more. */
  const wide less = dot_wide(m->miss, ray, 6) / (dot_wide(ray, ray, 6) + TINY_WIDE);
  add_scaled(m->miss, -less, ray);
  score[0] = rounded((real)norm_wide(m->miss));
  score[MISSING_RAY_SHARE] = (real)(1 - ray_share + less);
  if (ray_share > 0 || !(score[0] > 0)) return;
  ray_share = nearest_to_ray(block, work, from, ray, score);
  work->is_rim_exact = fl_has_lines_alone(block);
  keep_normal(block, work, weight, m->miss);
  score[MISSING_RAY_SHARE] = (real)(1 - ray_share);
}

/* Serves one group of axes, for a wrench over the wrench scale, while those before it are held;
   `missing` becomes what it lacks. Its length. A group that wants more than there is pulls
   at the held axes: then it weighs so much less that these give way by as little as they do
   for a miss of `PULL`. */
static wide serve_group(const real *block, fl_work *work, const wide *wanted,
                        const unsigned char *held, const unsigned char *group, int is_first,
                        wide *missing) {
  wide missed = PULL;
  int rounds = 2;
  if (is_first) rounds = 1;
  for (int round = 0; round < rounds && missed >= PULL; round++) {
    wide weight[6];
    for (int k = 0; k < 6; k++) weight[k] = HELD * held[k] + sqrt(PULL / missed) * group[k];
    serve_weighted(block, work, weight, wanted, missing);
    for (int k = 0; k < 6; k++) missing[k] *= group[k];
    missed = norm_wide(missing);
    /* What a group misses by rounding has no direction: the rim is that of the one before. */
    if (is_first || missed > NEARLY) keep_normal(block, work, weight, work->mixture.miss);
  }
  return missed;
}

static void serve_priority(const real *block, fl_work *work, wide *wanted, const fl_policy *policy,
                           real *score) {
  unsigned char held[6] = {0};
  for (int g = 0; g < policy->group_count; g++) {
    const unsigned char *group = policy->group[g];
    wide missing[6] = {0};
    const wide missed = serve_group(block, work, wanted, held, group, g == 0, missing);
    for (int k = 0; k < 6; k++) {
      held[k] |= group[k];
      wanted[k] -= missing[k]; /* of held axes what they have got */
    }
    score[g] = rounded((real)missed);
  }
  /* The normal is that of axes of very different weights, by which rounding counts as a price. */
  if (fl_has_lines_alone(block)) work->is_rim_exact = 0;
}

#ifdef FL_WITH_FALLING
/* Holds the falling axis that is farthest beyond its range, from nothing to what was asked for, at
   that end of it, or lets go the one that is pulled most back into it. Returns whether there was
   one. */
static int change_hold(const wide *asked, const unsigned char *falls, const wide *missing,
                       unsigned char *held, wide *wanted) {
  int changed = -1;
  wide most = NEARLY;
  wide end = 0;
  for (int k = 0; k < 6; k++) {
    if (!falls[k]) continue;
    const wide given = wanted[k] - missing[k];
    const wide far_end = wanted[k] == asked[k] ? 0 : asked[k];
    wide into = given * asked[k] > 0 ? asked[k] : 0; /* the end that it is beyond */
    wide size = fabs(given) - fabs(into);
    if (held[k]) {
      /* the others' pull on it, and its own to what was asked for */
      const wide pull = asked[k] - wanted[k] - HELD * HELD * missing[k];
      size = -1;
      if (pull * (far_end - wanted[k]) > 0) size = fabs(pull) - TURNED;
      into = asked[k];
    }
    if (!(size > most)) continue;
    most = size;
    changed = k;
    end = into;
  }
  if (changed < 0) return 0;
  held[changed] ^= 1;
  wanted[changed] = end;
  return 1;
}

/* The nearest wrench that gives along the axes of the first group between nothing and what was
   asked for, Eq. 12 under bounds: an axis that is beyond is held at that end, by the weight HELD,
   and let go again where it is pulled back (an active set). At last the others weigh so much less
   that held axes give way no more than they do for a miss of PULL. */
static void serve_falling(const real *block, fl_work *work, const wide *asked,
                          const fl_policy *policy, real *score) {
  unsigned char held[6] = {0};
  wide wanted[6];
  wide missing[6];
  wide weight[6];
  wide loose_weight = 1;
  memcpy(wanted, asked, sizeof wanted);
  for (int round = 0;; round++) {
    for (int k = 0; k < 6; k++) weight[k] = held[k] ? HELD : loose_weight;
    serve_weighted(block, work, weight, wanted, missing);
    keep_normal(block, work, weight, work->mixture.miss);
    if (round < HOLDS && change_hold(asked, policy->group[0], missing, held, wanted)) continue;
    wide all_missing[6];
    for (int k = 0; k < 6; k++) all_missing[k] = asked[k] - wanted[k] + missing[k];
    const wide missed = norm_wide(all_missing);
    score[0] = rounded((real)missed);
    if (round == 0 || !(missed > PULL) || loose_weight < 1) break;
    loose_weight = sqrt(PULL / missed);
    round = HOLDS;
  }
  /* The normal is that of axes of very different weights, by which rounding counts as a price. */
  if (loose_weight < 1 && fl_has_lines_alone(block)) work->is_rim_exact = 0;
}
#endif

/* Serves a policy within the sets of a part; how badly, the first number counting most, the
   numbers that a policy does not use 0:

   - closest: score[0] is the distance from the wrench, by the weights of the axes;
   - direction: score[0] is what misses across the ray, score[MISSING_RAY_SHARE] the share of the
     wrench that is not given, Eqs. 14 and 15;
   - priority: score[g] is what group g lacks;
   - falling: score[0] is the distance from the wrench.

   All but the share are distances over the wrench scale, rounded. */
static void serve(const real *block, fl_work *work, const real *wrench, const fl_policy *policy,
                  real force[][2], real *score) {
  memset(score, 0, FL_SCORES * sizeof *score);
  wide wanted[6]; /* over the wrench scale */
  for (int k = 0; k < 6; k++) wanted[k] = over_wrench_scale(block, wrench, k);
  work->mixture.count = 0;
  if (policy->kind == FL_DIRECTION)
    serve_direction(block, work, wrench, score);
  else if (policy->kind == FL_PRIORITY)
    serve_priority(block, work, wanted, policy, score);
#ifdef FL_WITH_FALLING
  else if (policy->kind == FL_FALLING)
    serve_falling(block, work, wanted, policy, score);
#endif
  else
    serve_closest(block, work, wanted, policy, score);
  fl_mixed_forces(block, &work->mixture, force);
}

/* Whether a score is better than another one. */
static int is_better(const real *a, const real *b) {
  for (int k = 0; k < FL_SCORES; k++) {
    if (a[k] != b[k]) return a[k] < b[k];
  }
  return 0;
}

/* Forces in the middle of all sets. */
static void middle_of_sets(const real *block, const fl_work *work, real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_set *set = work->set + i;
    real size = (set->force_min + set->force_max) / 2;
    force[i][0] = size;
    force[i][1] = fl_drag_of_lift(block, i, size);
    if (!is_plane(ACTUATOR(block, i))) continue;
    const int is_around_rest = !(set->sector_half_angle < PI) || set->force_max_reverse > 0;
    if (is_around_rest) size = 0;
    force[i][0] = size * set->cos_center;
    force[i][1] = size * set->sin_center;
  }
}

/* Size of the way between two wrenches, on their scale. */
static real scaled_distance(const fl_work *work, const real *from, const real *to) {
  real squared = 0;
  for (int k = 0; k < 6; k++) {
    const real change = (to[k] - from[k]) / work->span.axis_scale[k];
    squared += change * change;
  }
  return SQRT(squared);
}

/* Takes what Newton's method came to, for a wrench, into an answer. */
static void take_answer(const real *block, const fl_work *work, const real *wrench,
                        fl_answer *out) {
  const fl_state *state = work->state_found;
  memcpy(out->lambda_reduced, state->lambda_reduced, sizeof out->lambda_reduced);
  copy_forces(block, work->state_found->force, out->force);
  memcpy(out->wrench_served, wrench, sizeof out->wrench_served);
  if (TOLERANCE < AT_RIM && state->residual_size > TOLERANCE) {
    fl_wrench_of_forces(block, work, out->force, out->wrench_served);
  }
}

/* The least power for a wrench that forces give, or hardly another one that is wanted; a
   little towards the wrench `inside` where power is steep at the rim; where Newton's method
   settles at none, these forces. work->state_found is that of the last trial. */
static void cheapest_forces(const real *block, fl_work *work, real force[][2], const real *inside,
                            const real *wanted, fl_answer *out) {
  enum { WANTED, GIVEN, INSIDE, TRIALS };
  real given[6];
  fl_wrench_of_forces(block, work, force, given);
  copy_forces(block, force, out->force);
  memcpy(out->wrench_served, given, sizeof given);
  const real distance_inside = scaled_distance(work, given, inside);
  real most_power = INFEASIBLE_COST;
  real lambda[6];
  real target_given[6];
  fl_reduce_wrench(work, given, target_given);
  int first = WANTED;
  if (are_same(wanted, given, sizeof given)) first = GIVEN;
  for (int trial = first; trial < TRIALS; trial++) {
    real wrench[6];
    real target_reduced[6];
    for (int k = 0; k < 6; k++) {
      const real share = (trial == INSIDE) * NEARLY;
      wrench[k] = given[k] + share * (inside[k] - given[k]) / larger(1, distance_inside);
      if (trial == WANTED) wrench[k] = wanted[k];
    }
    fl_reduce_wrench(work, wrench, target_reduced);
    if (trial == INSIDE && most_power < INFEASIBLE_COST && work->is_rim_exact) {
      real moved[6]; /* inside, from the rim */
      for (int j = 0; j < 6; j++) moved[j] = target_given[j] - target_reduced[j];
      memcpy(lambda, out->lambda_reduced, sizeof lambda);
      fl_first_lambda_inside(block, work, target_reduced, work->rim_normal,
                             dot(work->rim_normal, moved, 6), lambda);
    } else if (work->is_rim_exact) {
      fl_first_lambda_at_rim(block, work, target_reduced, work->rim_normal, lambda);
    }
    const real *first_lambda = 0; /* Newton's method's own */
    if (work->is_rim_exact) first_lambda = lambda;
    work->power_of_use = most_power;
    if (!work->is_rim_exact) work->residual_enough = larger(SAME_POINT, TOLERANCE);
    fl_dual_newton(block, work, target_reduced, first_lambda, FL_STEPS_AT_KINK);
    work->power_of_use = INFEASIBLE_COST;
    work->residual_enough = TOLERANCE;
    const real dual_value = work->state_found->dual_value;
    const int has_met = !(work->state_found->residual_size > larger(AT_RIM, ENOUGH));
    if (!has_met || dual_value > most_power) continue;
    take_answer(block, work, wrench, out);
    most_power = (1 - FINE) * dual_value;
    const int is_steep =
        !(dot(out->lambda_reduced, target_reduced, 6) <= FINE / NEARLY * dual_value);
    if (trial != GIVEN || !is_steep) return;
  }
}

/* Serves both sides of a cut and stays at the one that does better. */
static void better_side(const real *block, fl_work *work, const real *wrench,
                        const fl_policy *policy, fl_cut *cut, real force[][2], real *score) {
  real force_other[FL_MOST][2];
  cut->first_side = fl_nearer_side(block, cut->actuator, &cut->set_before, cut->force);
  fl_take_side(block, work, cut, -cut->first_side);
  serve(block, work, wrench, policy, force_other, cut->score);
  fl_take_side(block, work, cut, cut->first_side);
  serve(block, work, wrench, policy, force, score);
  if (!is_better(cut->score, score)) return;
  for (int k = 0; k < FL_SCORES; k++) {
    const real kept = score[k];
    score[k] = cut->score[k];
    cut->score[k] = kept;
  }
  copy_forces(block, force_other, force);
  cut->first_side = -cut->first_side;
  fl_take_side(block, work, cut, cut->first_side);
}

/* How many parts of sets with gaps a policy may look at: each takes a nearest point. */
static int most_parts_of_policy(const real *block, const fl_work *work) {
  int most = REACH_PARTS + REACH_PARTS_EACH * COUNT(block);
  for (int i = 0; i < COUNT(block); i++) {
    if (has_arc(work->set + i)) most += REACH_PARTS_ARC;
  }
  if (most < work->settings.most_parts) return most;
  return work->settings.most_parts;
}

/* The last cut whose other side may be better than a score; 0 where there is none. */
static fl_cut *last_better_cut(const real *block, fl_work *work, int *depth, const real *best) {
  for (;;) {
    fl_cut *cut = fl_last_open_cut(block, work, depth);
    if (!cut || is_better(cut->score, best)) return cut;
  }
}

/* The best part of sets with gaps for a policy, from the forces, score and gap of all sets on: its
   forces; its sets become those of the work area, and those that it began with are kept. */
static void best_part(const real *block, fl_work *work, const real *wrench, const fl_policy *policy,
                      int gap, real force[][2], real *best) {
  const int most_parts = most_parts_of_policy(block, work);
  real score[FL_SCORES];
  real force_part[FL_MOST][2];
  int depth = 0;
  int has_found = 0; /* a part whose best answer lies in no gap */
  int is_whole = 1;  /* whether the best part is that of all sets */
  memcpy(score, best, sizeof score);
  copy_forces(block, force, force_part);
  copy_sets(block, work->set, work->best_set);
  work->distance_enough = ROUGHLY;
  for (int parts = 0;; parts += 2) {
    if (parts > 0) gap = fl_worst_gap(block, work, force_part, 0);
    if (gap < 0 || !has_found) { /* of parts with a gap the last one, until there is one without */
      memcpy(best, score, sizeof score);
      copy_forces(block, force_part, force);
      copy_sets(block, work->set, work->best_set);
      has_found |= gap < 0;
      is_whole = parts == 0;
    }
    fl_cut *cut = 0;
    if (gap >= 0 && parts < most_parts) {
      cut = fl_cut_set(block, work, &depth, gap, force_part[gap]);
    }
    if (cut) {
      better_side(block, work, wrench, policy, cut, force_part, score);
      if (!has_found || is_better(score, best)) continue;
    }
    cut = last_better_cut(block, work, &depth, best);
    if (!cut || parts >= most_parts) break;
    fl_take_side(block, work, cut, -cut->first_side);
    serve(block, work, wrench, policy, force_part, score);
  }
  fl_restore_sets(block, work, work->best_set);
  work->distance_enough = SAME_POINT;
  if (!is_whole) serve(block, work, wrench, policy, force, best);
}

/* What a policy wants of forces: their wrench, but exactly the one that was asked for in the
   axes that have it but for what tables are off. */
static void wrench_wanted_of(const real *block, const fl_work *work, const real *wrench,
                             real force[][2], real *wanted) {
  const real *scale = HEAD(block)->wrench_scale;
  fl_wrench_of_forces(block, work, force, wanted);
  for (int k = 0; k < 6; k++) {
    if (FABS(wanted[k] - wrench[k]) <= FINE * scale[k]) wanted[k] = wrench[k];
  }
}

/* Looks for least power for an answer's wrench in other parts of sets with gaps, from what
   Newton's method came to for it (`status`, work->state_found). */
static void cheapen_by_parts(const real *block, fl_work *work, const real *target_reduced,
                             int status, fl_answer *out) {
  if (status == FL_BEYOND) return;
  fl_state *state = work->state_found;
  /* those of all sets prove more than those of a part */
  memcpy(out->lambda_reduced, state->lambda_reduced, sizeof out->lambda_reduced);
  const int gap = fl_worst_gap(block, work, state->force, state->lambda_reduced);
  if (gap < 0) {
    if (status == FL_MET) copy_forces(block, state->force, out->force);
    return;
  }
  real bound;
  if (!fl_search_gaps(block, work, target_reduced, status, &bound)) return;
  copy_forces(block, work->best_force, out->force);
  out->gap_power_bound = fl_gap_power_bound(work, bound);
}

#if FL_ARCS > 0
/* Comes closer to what a policy wants where foils may stall, from the forces of the best part on:
   arcs around their angles become shorter and shorter, until forces are on the curves of foils. */
static void come_closer(const real *block, fl_work *work, const real *wrench,
                        const fl_policy *policy, real force[][2], real *score) {
  for (int round = 0; round < CLOSER_ROUNDS; round++) {
    const real width = fl_lay_closer_arcs(block, work, round == 0, force);
    serve(block, work, wrench, policy, force, score);
    if (width < NEARLY) break;
  }
}

/* Makes an answer the cheapest commands for the wrench of some commands: these themselves made
   cheaper by steps, or what a search from other starts comes to, where the tables of foils have
   that wrench. */
static void cheapest_commands(const real *block, fl_work *work, real command[][3], fl_answer *out) {
  real force[FL_MOST][2];
  real target_reduced[6];
  real with_offset[6]; /* wrench that the commands are to give [N, N m] */
  const real cost_before = fl_power_of_commands(block, work, command, force);
  fl_wrench_of_forces(block, work, force, out->wrench_served);
  fl_reduce_wrench(work, out->wrench_served, target_reduced);
  for (int k = 0; k < 6; k++) with_offset[k] = out->wrench_served[k] + work->span.wrench_offset[k];
  const int status = fl_dual_newton(block, work, target_reduced, 0, FL_STEPS_AT_KINK);
  memcpy(work->wrench_wanted, with_offset, sizeof with_offset);
  memcpy(out->lambda_reduced, work->state_found->lambda_reduced, sizeof out->lambda_reduced);
  real best_cost = cost_before;
  real cost_searched = INFEASIBLE_COST;
  if (status == FL_MET &&
      fl_answer_with_drag(block, work, with_offset, target_reduced, status, out)) {
    cost_searched = fl_power_of_commands(block, work, out->command, force);
  }
  fl_improve_from(block, work, target_reduced, out->lambda_reduced, command, &best_cost);
  if (best_cost < cost_before) copy_commands(block, work->best_command, command);
  if (!(cost_searched < best_cost)) copy_commands(block, command, out->command);
  fl_power_of_commands(block, work, out->command, out->force);
  out->has_foil_commands = 1;
}

/* The same as below where foils may stall. */
static void serve_on_arcs(const real *block, fl_work *work, const real *wrench,
                          const fl_policy *policy, fl_answer *out) {
  real force[FL_MOST][2];
  real score[FL_SCORES];
  copy_sets(block, work->set, work->set_before);
  fl_lay_arcs(block, work);
  work->distance_enough = SAME_POINT;
  serve(block, work, wrench, policy, force, score);
  const int gap = fl_worst_gap(block, work, force, 0);
  if (gap >= 0) best_part(block, work, wrench, policy, gap, force, score);
  come_closer(block, work, wrench, policy, force, score);
  real command[FL_MOST][3];
  fl_commands_on_arcs(block, work, force, command);
  fl_restore_sets(block, work, work->set_before);
  cheapest_commands(block, work, command, out);
  if (policy->kind != FL_DIRECTION) return;
  fl_largest_ray_share(block, work, wrench, command, 0, 1 - score[MISSING_RAY_SHARE], out);
}
#endif

void fl_out_of_reach(const real *block, fl_work *work, const real *wrench, const fl_policy *policy,
                     fl_answer *out) {
  const int keeps_direction = policy->kind == FL_DIRECTION;
  real force[FL_MOST][2];
  real score[FL_SCORES];
  memcpy(work->rim_normal, work->state_found->lambda_reduced, sizeof work->rim_normal);
  work->distance_enough = SAME_POINT;
#if FL_ARCS > 0
  if (work->has_drag && fl_may_any_stall(block, work)) {
    serve_on_arcs(block, work, wrench, policy, out);
    return;
  }
#endif
  serve(block, work, wrench, policy, force, score);
  const real most_ray_share = 1 - score[MISSING_RAY_SHARE]; /* that all parts could give */
  const int gap = fl_worst_gap(block, work, force, 0);
  const int has_parts = gap >= 0;
  if (has_parts) {
    copy_sets(block, work->set, work->set_before);
    best_part(block, work, wrench, policy, gap, force, score);
  }
  const real ray_share = 1 - score[MISSING_RAY_SHARE];
  real inside[6] = {0};
  if (!keeps_direction) {
    real middle[FL_MOST][2];
    middle_of_sets(block, work, middle);
    fl_wrench_of_forces(block, work, middle, inside);
  }
  real wanted[6];
  wrench_wanted_of(block, work, wrench, force, wanted);
  cheapest_forces(block, work, force, inside, wanted, out);
  if (has_parts) fl_restore_sets(block, work, work->set_before);
  if (!fl_may_have_gaps(block, work, out->force)) return;

  real target_reduced[6];
  fl_reduce_wrench(work, out->wrench_served, target_reduced);
  /* Another part of the sets may give it for less. */
  real lambda[6];
  const real *first_lambda = 0; /* Newton's method's own, where a fork may have led astray */
  memcpy(lambda, out->lambda_reduced, sizeof lambda);
  if (!work->has_forks) first_lambda = lambda;
  const int status = fl_dual_newton(block, work, target_reduced, first_lambda, FL_STEPS);
  if (!work->has_drag) {
    cheapen_by_parts(block, work, target_reduced, status, out);
    return;
  }
  real with_offset[6]; /* wrench that the commands are to give [N, N m] */
  for (int k = 0; k < 6; k++) with_offset[k] = out->wrench_served[k] + work->span.wrench_offset[k];
  const int is_met = fl_answer_with_drag(block, work, with_offset, target_reduced, status, out);
  if (!keeps_direction || FL_ARCS == 0) return; /* without foils there is no more to do */
  const real found = (real)is_met * ray_share;
  real start[FL_MOST][3];
  fl_commands_for_forces(block, &work->box, out->force, work->command_previous, start);
  fl_largest_ray_share(block, work, wrench, start, found, most_ray_share, out);
}
