/* What is given in place of a wrench out of reach: the nearest one, the same direction, or groups of axes.

   Each is the point of a convex set nearest to another, in axes in which what counts more is longer. `closest`
   takes the axes by their weights, `direction` the farthest share of the target, `priority` the axes of one
   group after the other, what those before it have got held. Sets with gaps are cut until the best answer of
   all lies in none. */
#include "internal.h"

/* Whether so many bytes are the same, one of which was copied from the other. Not memcmp: WebAssembly has no library. */
static int are_same(const void *one, const void *other, size_t size) {
  const unsigned char *a = one, *b = other;
  for (size_t k = 0; k < size; k++)
    if (a[k] != b[k]) return 0;
  return 1;
}

#define ROUGHLY (NEARLY / 10) /* distance, on the yardstick, up to which the point of a part is the nearest one */
#define HELD 1e3      /* weight of an axis that is held over one of the group that is served */
#define AT_RIM (R(0.1) * NEARLY) /* scaled wrench by which an answer at the rim may be off: what it gives is then its aim */
#define PULL 2e-3     /* miss of a group for which held axes give way by a millionth at a curved rim */

static real rounded(real value) { return FLOOR(value / NEARLY + R(0.5)) * NEARLY; }

static wide on_yardstick(const real *block, const real *wrench, int k) {
  return (wide)wrench[k] / (wide)HEAD(block)->yard[k];
}

static void closest(const real *block, fl_work *work, const real *wrench, const fl_policy *policy, real *score) {
  wide weight[6], target[6];
  for (int k = 0; k < 6; k++) {
    weight[k] = MAX(policy->weight[k], CLOSE);
    target[k] = weight[k] * on_yardstick(block, wrench, k);
  }
  fl_weigh_axes(block, work, weight);
  work->mixture.count = 0;
  score[0] = rounded((real)fl_nearest_point(block, work, target, work->close, 0, &work->mixture));
}

/* The largest share of a wrench that can be given alone. In a tick there may be none, as drives cannot stop or turn at
   once: then what is nearest to any share. */
static void direction(const real *block, fl_work *work, const real *wrench, real *score) {
  fl_mixture *m = &work->mixture;
  real target[6], all[6];
  wide weight[6], begin[6], ray[6], plane[6];
  for (int k = 0; k < 6; k++) {
    weight[k] = 1;
    all[k] = wrench[k] + work->span.beside[k];
    begin[k] = -on_yardstick(block, work->span.beside, k);
  }
  fl_reduce_wrench(work, all, target);
  const int ranged = fl_is_in_range(work, all, target);
  for (int k = 0; k < 6; k++) /* what rounding has put beside the range is left out */
    ray[k] = ranged ? fl_out_of_range(block, work, target, k) : 0;
  fl_weigh_axes(block, work, weight);
  wide share = fl_farthest_along_ray(block, work, begin, ray, 0, 1, work->close, m, plane);
  const wide less = product(m->miss, ray, 6) / (product(ray, ray, 6) + 1e-300);
  add(m->miss, -less, ray);
  score[0] = rounded((real)length_of(m->miss));
  score[1] = (real)(1 - share + less);
  if (share > 0 || !(score[0] > 0)) return;
  m->count = 0;
  work->ray = ray;
  score[0] = rounded((real)fl_nearest_point(block, work, begin, work->close, 0, m));
  work->ray = 0;
  share = 0;
  for (int p = 0; p < m->count; p++) share += m->share[p] * m->along[p];
  score[1] = (real)(1 - share);
}

/* A group that wants more than there is pulls at the held axes: then it weighs so much less that these give way by as
   little as they do for a miss of `PULL`. */
static void priority(const real *block, fl_work *work, const real *wrench, const fl_policy *policy, real *score) {
  fl_mixture *m = &work->mixture;
  unsigned char held[6] = {0};
  wide aim[6]; /* on the yardstick */
  for (int k = 0; k < 6; k++) aim[k] = on_yardstick(block, wrench, k);
  m->count = 0;
  for (int g = 0; g < policy->groups; g++) {
    const unsigned char *group = policy->group[g];
    wide weight[6], target[6], missing[6] = {0}, missed = PULL;
    for (int round = 0; round < (g > 0 ? 2 : 1) && missed >= PULL; round++) {
      for (int k = 0; k < 6; k++) {
        weight[k] = HELD * held[k] + sqrt(PULL / missed) * group[k];
        target[k] = weight[k] * aim[k];
      }
      fl_weigh_axes(block, work, weight);
      m->done = 0; /* the points so far, in the axes of this group: */
      for (int p = 0; p < m->count; p++) fl_point_of_forces(block, work, m->force[p], m->point[p]);
      fl_nearest_point(block, work, target, work->close, 0, m);
      for (int k = 0; k < 6; k++)
        if (group[k]) missing[k] = m->miss[k] / weight[k];
      missed = length_of(missing);
    }
    for (int k = 0; k < 6; k++) {
      held[k] |= group[k];
      if (group[k]) aim[k] -= missing[k];
    }
    score[g] = rounded((real)missed);
  }
}

/* Serves a policy within the sets of a part; how badly, the first number counting most. */
static void serve(const real *block, fl_work *work, const real *wrench, const fl_policy *policy, real force[][2],
                  real *score) {
  memset(score, 0, FL_SCORES * sizeof *score);
  if (policy->policy == FL_DIRECTION)
    direction(block, work, wrench, score);
  else if (policy->policy == FL_PRIORITY)
    priority(block, work, wrench, policy, score);
  else
    closest(block, work, wrench, policy, score);
  fl_mixed_forces(block, &work->mixture, force);
}

static int is_less(const real *a, const real *b) {
  for (int k = 0; k < FL_SCORES; k++)
    if (a[k] != b[k]) return a[k] < b[k];
  return 0;
}

/* Forces in the middle of all sets. */
static void middle_of(const real *block, const fl_work *work, real force[][2]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_set *s = work->set + i;
    real size = (s->low + s->high) / 2;
    force[i][0] = size, force[i][1] = fl_drag_of_lift(block, i, size);
    if (is_plane(ACTUATOR(block, i))) {
      if (!(s->half < PI) || s->reverse > 0) size = 0;
      force[i][0] = size * s->cos_middle, force[i][1] = size * s->sin_middle;
    }
  }
}

/* The least power for a wrench that forces give, or hardly another one that is wanted; a little towards the wrench
   `inside` where power is steep at the rim; where Newton's method settles at none, these forces. */
static void cheapest(const real *block, fl_work *work, real force[][2], const real *inside, const real *wanted,
                     fl_answer *out) {
  real wrench[6], aim[6], target[6], size = 0, most = R(1e30);
  fl_wrench_of_forces(block, work, force, wrench);
  memcpy(out->force, force, (size_t)COUNT(block) * sizeof out->force[0]);
  memcpy(out->aim, wrench, sizeof wrench);
  for (int k = 0; k < 6; k++) {
    real way = (inside[k] - wrench[k]) / work->span.scale[k];
    size += way * way;
  }
  for (int tried = are_same(wanted, wrench, sizeof wrench) ? 1 : 0; tried < 3; tried++) {
    for (int k = 0; k < 6; k++)
      aim[k] = tried == 0 ? wanted[k] : wrench[k] + (tried == 2) * NEARLY * (inside[k] - wrench[k]) / MAX(1, SQRT(size));
    fl_reduce_wrench(work, aim, target);
    fl_dual_newton(block, work, target, 0, STEPS_AT_KINK);
    if (work->now->size > MAX(AT_RIM, ENOUGH) || work->now->value > most) continue;
    memcpy(out->inner, work->now->price, sizeof out->inner);
    memcpy(out->force, work->now->force, (size_t)COUNT(block) * sizeof out->force[0]);
    memcpy(out->aim, aim, sizeof aim);
    if (TOLERANCE < AT_RIM && work->now->size > TOLERANCE) fl_wrench_of_forces(block, work, out->force, out->aim);
    most = (1 - FINE) * work->now->value;
    if (tried != 1 || dot(out->inner, target, 6) <= FINE / NEARLY * work->now->value) return;
  }
}

/* Serves both sides of a cut and stays at the one that does better. */
static void better_side(const real *block, fl_work *work, const real *wrench, const fl_policy *policy, fl_node *node,
                        real force[][2], real *score) {
  real other[FL_MOST][2];
  node->first = fl_nearer_side(block, node->cut, &node->before, node->force);
  fl_take_side(block, work, node, -node->first);
  serve(block, work, wrench, policy, other, node->score);
  fl_take_side(block, work, node, node->first);
  serve(block, work, wrench, policy, force, score);
  if (!is_less(node->score, score)) return;
  for (int k = 0; k < FL_SCORES; k++) {
    real kept = score[k];
    score[k] = node->score[k], node->score[k] = kept;
  }
  memcpy(force, other, (size_t)COUNT(block) * sizeof *other);
  node->first = -node->first;
  fl_take_side(block, work, node, node->first);
}

/* The best part of sets with gaps for a policy: its forces; its sets become those of the work area, and those
   that it began with are kept. Of a ray the share that it gives, and the most that all parts could. */
static void best_part(const real *block, fl_work *work, const real *wrench, const fl_policy *policy,
                      real force[][2], real *share, real *most_share) {
  real score[FL_SCORES], best[FL_SCORES] = {0}, own[FL_MOST][2];
  int n = COUNT(block), depth = 0, most = MIN(8 * (ROUNDS + n), work->settings.most_parts), found = 0;
  fl_node *node = 0;
  memcpy(work->kept, work->set, sizeof work->kept);
  work->close = CLOSE_BY;
  serve(block, work, wrench, policy, own, score);
  *most_share = 1 - score[1];
  work->close = ROUGHLY;
  for (int parts = 0;; parts += 2) {
    int cut = fl_worst_gap(block, work, own, 0);
    if (cut < 0 || !found) { /* of parts with a gap the last one, until there is one without */
      memcpy(best, score, sizeof best);
      memcpy(force, own, sizeof own);
      memcpy(work->best_set, work->set, sizeof work->best_set);
      found |= cut < 0;
    }
    if (cut >= 0 && parts < most && (node = fl_cut_set(block, work, &depth, cut, own[cut]))) {
      better_side(block, work, wrench, policy, node, own, score);
      if (!found || is_less(score, best)) continue;
    }
    while ((node = fl_last_open_cut(block, work, &depth)) && !is_less(node->score, best)) {}
    if (!node || parts >= most) break;
    fl_take_side(block, work, node, -node->first);
    serve(block, work, wrench, policy, own, score);
  }
  fl_restore_sets(block, work, work->best_set);
  work->close = CLOSE_BY;
  if (!are_same(work->best_set, work->kept, (size_t)n * sizeof *work->kept)) serve(block, work, wrench, policy, force, best);
  *share = 1 - best[1];
}

void fl_out_of_reach(const real *block, fl_work *work, const real *wrench, const fl_policy *policy, fl_answer *out) {
  const fl_head *h = HEAD(block);
  real force[FL_MOST][2], middle[FL_MOST][2], inside[6] = {0}, wanted[6], target[6], value, share, most;
  best_part(block, work, wrench, policy, force, &share, &most);
  if (policy->policy != FL_DIRECTION) {
    middle_of(block, work, middle);
    fl_wrench_of_forces(block, work, middle, inside);
  }
  fl_wrench_of_forces(block, work, force, wanted);
  for (int k = 0; k < 6; k++)
    if (FABS(wanted[k] - wrench[k]) <= FINE * h->yard[k]) wanted[k] = wrench[k];
  cheapest(block, work, force, inside, wanted, out);
  fl_restore_sets(block, work, work->kept);
  if (!fl_may_have_gaps(block, work, out->force)) return;
  fl_reduce_wrench(work, out->aim, target); /* another part of the sets may give it for less */
  int status = fl_dual_newton(block, work, target, 0, MOST_STEPS);
  if (work->drags) {
    for (int k = 0; k < 6; k++) work->aim[k] = out->aim[k] + work->span.beside[k];
    int met = fl_answer_with_drag(block, work, target, status, out);
    if (policy->policy == FL_DIRECTION) fl_largest_ray_share(block, work, wrench, (real)met * share, most, out);
    return;
  }
  if (status == FL_BEYOND) return;
  memcpy(out->inner, work->now->price, sizeof out->inner); /* those of all sets prove more than those of a part */
  int gap = fl_worst_gap(block, work, work->now->force, work->now->price);
  if (gap < 0 && status == FL_MET)
    memcpy(out->force, work->now->force, (size_t)COUNT(block) * sizeof out->force[0]);
  else if (gap >= 0 && fl_search_gaps(block, work, target, status, &value)) {
    memcpy(out->force, work->best, (size_t)COUNT(block) * sizeof out->force[0]);
    out->value = work->turns ? 0 : value * (1 - FINE); /* with turning it is more than power */
  }
}
