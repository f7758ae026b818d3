/* One target after the other: least power where it is within what may be given now, else what a policy gives in its
   place. */
#include "internal.h"

int fl_version(void) { return FL_VERSION; }

const char *fl_error_text(int code) {
  static const char *const text[FL_ERRORS] = {
      "all is well",
      "the block is no robot of this library, or was cut or changed; export the robot again",
      "the block was made for another version of this library; export the robot again",
      "a number of the robot is out of the range that the library works with; check its forces, powers and sizes",
      "a number of the question is not finite or out of range; name an axis that may take any wrench in free",
  };
  if (code < 0) return "a search ended at its bound of parts; raise most_parts of fl_settings";
  return code < FL_ERRORS ? text[code] : "no error code of this library";
}

static int are_within(const real *values, int count, real most) {
  for (int k = 0; k < count; k++)
    if (!(FABS(values[k]) <= most)) return 0;
  return 1;
}

static int is_place(real place, real length, int numbers) {
  return place == FLOOR(place) && place >= 0 && place + (real)numbers <= (real)length;
}

#define LARGEST R(1e12) /* wrench, price or command of a question */
#define MOST_CALM 1000

/* Whether there is a table, or a gauge, at a place: its cells, or points, are few enough to lie in the block. */
static int is_table(const real *block, real place, real length, int counted, int each, int more) {
  if (!(place > 0 && is_place(place, length, 3))) return 0;
  real count = block[(int)place + counted];
  return count >= 1 && count <= 65536 && count == FLOOR(count) &&
         is_place(place, length, (counted ? 3 : 1) + each * ((int)count + more));
}

static int is_grid(const real *block, real place, real length) {
  if (!(place > 0 && is_place(place, length, 7))) return 0;
  const real *grid = block + (int)place;
  real knots = 0, points = 1;
  for (int k = 0; k < 3; k++) {
    if (!(grid[k] >= 1 && grid[k] <= 65536 && grid[k] == FLOOR(grid[k]))) return 0;
    knots += grid[k], points *= grid[k];
  }
  if (!(grid[3] >= 0 && grid[5] >= 1 && grid[5] <= 3 && grid[5] == FLOOR(grid[5]))) return 0;
  if (place + 7 + knots + points * grid[5] > length) return 0;
  for (int k = 0, at = 7; k < 3; at += (int)grid[k++])
    for (int j = 1; j < (int)grid[k]; j++)
      if (!(grid[at + j] > grid[at + j - 1])) return 0;
  const real *last = grid + 7 + (int)knots - 1, *first = last + 1 - (int)grid[2];
  return grid[3] == 0 || *first + grid[3] > *last;
}

/* Whether a block can be worked with; an error code. */
int fl_check(const real *block, int length) {
  const int head = sizeof(fl_head) / sizeof(real), own = sizeof(fl_actuator) / sizeof(real);
  if (length < head || block[0] != FL_MAGIC || HEAD(block)->length != (real)length) return FL_BAD_BLOCK;
  if (block[1] != FL_VERSION) return FL_BAD_VERSION;
  if (!are_within(block, length, R(1e30))) return FL_BAD_NUMBER;
  const fl_head *h = HEAD(block);
  if (!(h->n >= 1 && h->n <= FL_MOST && h->n == FLOOR(h->n) && length >= head + own * (int)h->n)) return FL_BAD_BLOCK;
  if (!(h->range >= 0 && h->range <= 6 && h->range == FLOOR(h->range))) return FL_BAD_BLOCK;
  for (int k = 0; k < 6; k++)
    if (!(h->scale[k] > 0 && h->yard[k] > 0 && (h->counts[k] == 0 || h->counts[k] == 1))) return FL_BAD_NUMBER;
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    if (a->rows != 1 && a->rows != 2) return FL_BAD_BLOCK;
    if (!is_table(block, a->ahead, h->length, 1, 3, 1)) return FL_BAD_BLOCK;
    if (a->back != 0 && !is_table(block, a->back, h->length, 1, 3, 1)) return FL_BAD_BLOCK;
    if (a->gauge != 0 && !is_table(block, a->gauge, h->length, 0, 4, 0)) return FL_BAD_BLOCK;
    if (!(a->form >= FL_THRUSTER && a->form <= FL_FOIL && a->form == FLOOR(a->form))) return FL_BAD_BLOCK;
    if (a->form >= FL_FIN && !is_table(block, a->beat, h->length, 0, 2, a->form == FL_FIN)) return FL_BAD_BLOCK;
    if (a->form >= FL_FIN ? !is_grid(block, a->law, h->length) : a->law != 0) return FL_BAD_BLOCK;
    int used = a->form == FL_FIN ? 3 : a->form == FL_POD ? 2 : 1;
    for (int k = 0; k < 3; k++)
      if (!((k < used ? a->lower[k] <= a->upper[k] : a->lower[k] == 0 && a->upper[k] == 0) && a->step[k] >= 0))
        return FL_BAD_NUMBER;
    if (!(block[(int)a->ahead] > 0 && (a->back == 0 || block[(int)a->back] > 0))) return FL_BAD_NUMBER;
    if (!(a->share > 0 && a->worth > 0 && a->most[0] > 0 && a->low <= a->high && a->half >= 0)) return FL_BAD_NUMBER;
    if (!(a->band >= 0 && a->speed >= 0 && a->gain[0] >= 0 && a->gain[1] >= 0 && a->doubt >= 0)) return FL_BAD_NUMBER;
    if (a->speed > 0 && !(a->form == FL_FOIL && a->rows == 2)) return FL_BAD_BLOCK;
  }
  return 0;
}

/* Forces for a wrench, of which what is on top of the forces is taken off already. */
static void answer(const real *block, fl_work *work, const real *wrench, const fl_policy *policy, const real *price,
                   fl_answer *out) {
  const int n = COUNT(block);
  const fl_span *span = &work->span;
  real target[6];
  out->value = 0, out->status = FL_MET, out->placed = 0;
  memset(out->inner, 0, sizeof out->inner);
  memset(out->price, 0, sizeof out->price);
  memset(out->force, 0, (size_t)n * sizeof out->force[0]);
  memcpy(out->aim, wrench, sizeof out->aim);
  fl_reduce_wrench(work, wrench, target);
  if (span->range == 0) { /* nothing pushes, such as foils at rest */
    out->within = 1;
    for (int k = 0; k < 6; k++) out->within &= wrench[k] == 0, out->aim[k] = 0;
    return;
  }
  const int torn = work->torn || work->drags || work->turns;
  const int ranged = fl_is_in_range(work, wrench, target);
  int status = fl_dual_newton(block, work, target, price, torn ? STEPS_AT_KINK : MOST_STEPS);
  int within = (status == FL_MET || (status == FL_STUCK && torn)) && ranged;
  out->status = status;
  memcpy(out->inner, work->now->price, sizeof out->inner);
  memcpy(out->force, work->now->force, (size_t)n * sizeof out->force[0]);
  if (work->drags) {
    within = ranged && fl_answer_with_drag(block, work, target, status, out);
    if (within) memcpy(out->force, work->best, (size_t)n * sizeof out->force[0]);
  }
  if (!work->drags && fl_may_have_gaps(block, work, out->force)) {
    int inside = fl_worst_gap(block, work, out->force, out->inner) >= 0;
    if (within && inside) {
      real value;
      within = fl_search_gaps(block, work, target, status, &value);
      if (within) memcpy(out->force, work->best, (size_t)n * sizeof out->force[0]);
      out->value = within && !work->turns ? value * (1 - FINE) : 0; /* with turning it is more than power */
    } else
      within &= status == FL_MET;
  }
  if (!(out->within = within) && policy) out->placed = 0, fl_out_of_reach(block, work, wrench, policy, out);
  for (int k = 0; k < 6; k++) out->price[k] = dot(span->basis[k], out->inner, span->range) / span->scale[k];
}

/* Prices in the basis to begin with; 0 where there are none, or none of use. */
static const real *first_prices(const fl_work *work, const fl_question *q, real *inner) {
  if (!q->price) return work->begins ? work->begin : 0;
  fl_reduce_lambda(work, q->price, inner);
  return are_within(inner, 6, LARGEST) ? inner : 0;
}

/* Whether commands rest in a dead band that the drive cannot leave at once, or that it may have to pass. */
static int may_pass_bands(const real *block, const fl_work *work, real command[][3]) {
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const int k = fl_force_number(a);
    if (work->span.lost[i] || !fl_is_in_dead_band(a, command[i])) continue;
    if (work->box.low[i][k] > a->lower[k] || work->box.high[i][k] < a->upper[k]) return 1;
  }
  return 0;
}

/* Has drives that give nothing in a tick pass through their dead bands: each goes, within its band, towards the command
   that it would have if drives were as quick as can be. */
static void pass_bands(const real *block, fl_work *work, const fl_question *q, real command[][3]) {
  const fl_box box = work->box;
  fl_answer later;
  real wrench[6];
  fl_limits_without_tick(block, work);
  for (int k = 0; k < 6; k++) wrench[k] = work->span.counts[k] ? q->wrench[k] - work->span.beside[k] : 0;
  memcpy(work->aim, q->wrench, sizeof work->aim);
  answer(block, work, wrench, q->policy, 0, &later);
  for (int i = 0; i < COUNT(block); i++) {
    const fl_actuator *a = ACTUATOR(block, i);
    const int k = fl_force_number(a);
    const real inside = a->band * (1 - 10 * NEARLY);
    real wanted[3];
    if (work->span.lost[i] || !fl_is_in_dead_band(a, command[i]) || size_of(later.force[i]) < inside) continue;
    fl_command_for_force(block, i, &box, later.force[i], q->previous + 3 * i, wanted);
    wanted[k] = CLIP(wanted[k], -inside, inside);
    memcpy(command[i], wanted, sizeof wanted);
  }
  work->box = box;
  work->is_whole = 0;
}

/* Meets a wrench a little beyond what the tables give by steps on commands: the last share of a force has no price that
   a table could hold. */
static void meet_by_laws(const real *block, fl_work *work, const real *asked, fl_answer *out) {
  const real *yard = HEAD(block)->yard;
  real missing[6];
  real tried[FL_MOST][3];
  for (int k = 0; k < 6; k++) missing[k] = (out->aim[k] - asked[k]) / yard[k];
  if (out->within || SQRT(dot(missing, missing, 6)) > 10 * CLOSE) return;
  memcpy(tried, out->command, (size_t)COUNT(block) * sizeof *tried);
  const real error = fl_refine_commands(block, work, &work->box, asked, tried, ROUNDS);
  if (error > NEARLY) return;
  memcpy(out->command, tried, (size_t)COUNT(block) * sizeof *tried);
  memcpy(out->aim, asked, sizeof out->aim);
  out->within = 1;
  out->value = 0;
  out->error = error;
}

static void answered(const real *block, fl_work *work, const fl_question *q, fl_answer *out) {
  const fl_span *span = &work->span;
  real wrench[6];
  real inner[6];
  for (int k = 0; k < 6; k++) work->aim[k] = span->counts[k] ? q->wrench[k] : 0;
  for (int k = 0; k < 6; k++) wrench[k] = work->aim[k] - span->beside[k];
  real asked[6];
  memcpy(asked, work->aim, sizeof asked);
  work->steps = work->ended = 0;
  work->previous = q->previous;
  answer(block, work, wrench, q->policy, first_prices(work, q, inner), out);
  for (int k = 0; k < 6; k++) out->aim[k] = out->within ? asked[k] : out->aim[k] + span->beside[k];
  if (!out->placed) {
    fl_commands_for_forces(block, &work->box, out->force, q->previous, out->command);
    fl_leave_dead_bands(block, out->force, out->command);
  }
  out->error = fl_refine_commands(block, work, &work->box, out->aim, out->command, work->settings.command_steps);
  meet_by_laws(block, work, asked, out);
  fl_rest_in_dead_bands(block, &work->box, out->command);
  if (q->previous && may_pass_bands(block, work, out->command)) pass_bands(block, work, q, out->command);
  fl_clip_commands(block, &work->box, out->command);
  out->steps = work->steps;
  out->ended = work->ended;
}

/* An answer to a question; an error code. */
int fl_answer_one(const real *block, fl_work *work, const fl_question *q, fl_answer *out) {
  const fl_policy *policy = q->policy;
  if (!are_within(q->wrench, 6, LARGEST)) return FL_BAD_ARGUMENT;
  if (!(q->calm >= 0 && q->calm <= MOST_CALM)) return FL_BAD_ARGUMENT;
  if (q->ticks < 0) return FL_BAD_ARGUMENT;
  if (policy) {
    if (policy->policy < FL_CLOSEST || policy->policy > FL_PRIORITY) return FL_BAD_ARGUMENT;
    if (policy->policy == FL_PRIORITY && (policy->groups < 0 || policy->groups > 6)) return FL_BAD_ARGUMENT;
    if (policy->policy == FL_CLOSEST && !are_within(policy->weight, 6, 1)) return FL_BAD_ARGUMENT;
  }
  for (int k = 0; q->previous && k < 3 * COUNT(block); k++)
    if (FABS(q->previous[k]) > LARGEST) return FL_BAD_ARGUMENT;
  for (int i = 0; q->toward && i < COUNT(block); i++)
    if (FABS(q->toward[i]) > LARGEST) return FL_BAD_ARGUMENT;
  if (!fl_prepare_question(block, work, q)) return FL_BAD_NUMBER;
  answered(block, work, q, out);
  return are_within(out->aim, 6, R(1e30)) && are_within(&out->error, 1, R(1e30)) ? 0 : FL_BAD_NUMBER;
}
