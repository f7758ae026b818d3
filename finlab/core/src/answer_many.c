/* Many answers, all of one question but the wrench: in vector lanes where they can, each by itself
   where not. */
#include "lanes.h"

#ifdef HAS_X86_LANES
#include <cpuid.h>
#endif

#ifdef HAS_X86_LANES
/* Bits of CPUID, and of the register XCR0, in which a system says what it saves of a task: Intel 64
   and IA-32 Architectures Software Developer's Manual, volume 1, chapters 13 to 15. */
enum {
  OSXSAVE = 1 << 27,                /* leaf 1, ECX: XCR0 can be read */
  HAS_AVX2 = 1 << 5,                /* leaf 7, EBX */
  HAS_AVX512 = 1 << 16 | 1 << 17,   /* leaf 7, EBX: AVX512F and AVX512DQ */
  SAVES_AVX = 1 << 1 | 1 << 2,      /* XCR0: registers of SSE and AVX */
  SAVES_AVX512 = SAVES_AVX | 7 << 5 /* XCR0: these, and masks and registers of AVX-512 */
};

static int has_all(unsigned bits, int wanted) { return ((int)bits & wanted) == wanted; }

/* What __builtin_cpu_supports says, to which not every compiler's library has an answer. */
int fl_widest_lanes(void) {
  unsigned a;
  unsigned b;
  unsigned c;
  unsigned d;
  unsigned saved;
  unsigned unused;
  if (!__get_cpuid(1, &a, &b, &c, &d) || !has_all(c, OSXSAVE)) return LANES_BASELINE;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return LANES_BASELINE;
  __asm__ volatile("xgetbv" : "=a"(saved), "=d"(unused) : "c"(0));
  if (has_all(b, HAS_AVX512) && has_all(saved, SAVES_AVX512)) return LANES_AVX512;
  if (has_all(b, HAS_AVX2) && has_all(saved, SAVES_AVX)) return LANES_AVX2;
  return LANES_BASELINE;
}
#elif defined(HAS_LANES)
int fl_widest_lanes(void) { return LANES_BASELINE; }
#else
int fl_widest_lanes(void) { return 1; }
#endif

/* The kernel of so many lanes; 0 where there is none. */
static lanes_kernel kernel_of(int lanes) {
  (void)lanes; /* in single precision there is none */
#ifdef HAS_LANES
  if (lanes == LANES_BASELINE) return fl_lanes_baseline;
#endif
#ifdef HAS_X86_LANES
  if (lanes == LANES_AVX2) return fl_lanes_avx2;
  if (lanes == LANES_AVX512) return fl_lanes_avx512;
#endif
  return 0;
}

/* Whether four knots of an axis of so many stand in a row, or there is one alone. */
static int has_window(real count) { return count == 1 || count >= 4; }

/* Whether lanes know the kind of an actuator. */
static int is_known_kind(const real *block, const fl_work *work, int i) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  const int kind = (int)a->command_kind;
  if (is_foil(a) || has_gauge_table(a) || is_steered(a) || a->barred_count > 0 || set->tangent)
    return 0;
  if (kind == FL_THRUSTER) return a->rows == 1;
  if (kind == FL_POD) return set->force_max_reverse == 0 && !set->is_flipped;
  if (kind != FL_FIN) return 0;
  const real *grid = block + (int)a->law_grid;
  const int has_one_column = grid[5] == 1;
  const int has_no_third_axis = grid[2] == 1;
  const int has_windows = has_window(grid[0]) && has_window(grid[1]);
  return has_one_column && has_no_third_axis && has_windows && a->unevenness == 0;
}

static void read_actuator(const real *block, const fl_work *work, int i, lanes_actuator *own) {
  const fl_actuator *a = ACTUATOR(block, i);
  const fl_set *set = work->set + i;
  own->kind = (int)a->command_kind;
  own->is_plane = is_plane(a);
  memcpy(own->column, work->span.effectiveness_reduced[i], sizeof own->column);
  int reverse = (int)a->force_table;
  if (!own->is_plane && a->force_table_reverse > 0) reverse = (int)a->force_table_reverse;
  own->has_reverse = reverse != (int)a->force_table;
  read_price_table(block, (int)a->force_table, own->table);
  read_price_table(block, reverse, own->table + 1);
  own->is_one_cell = own->table[0].cells == 1 && own->table[1].cells == 1;
  own->force_scale = a->force_scale;
  own->power_scale = a->power_scale;
  own->price_ratio = a->force_scale / a->power_scale;

  own->force_min = set->force_min;
  own->force_max = set->force_max;
  own->cost_at_min = set->cost_at_min;
  own->cost_at_max = set->cost_at_max;
  own->has_arc = own->is_plane && set->sector_half_angle < PI;
  own->is_forked = set->is_forked;
  own->half_angle = set->sector_half_angle;
  own->center[0] = set->cos_center;
  own->center[1] = set->sin_center;
  own->half[0] = set->cos_half_angle;
  own->half[1] = set->sin_half_angle;
  for (int k = 0; k < 2; k++) {
    real end = set->sector_center + set->sector_half_angle;
    if (k == 0) end = set->sector_center - set->sector_half_angle;
    own->end[k][0] = COS(end);
    own->end[k][1] = SIN(end);
  }
  own->price_floor_squared = set->price_floor_squared;
  own->blend_width = blend_width(set->cost_at_max);

  own->price_quadratic = a->row_force_max[0] / a->secant[0];
  own->secant_quadratic = a->secant[0];
  for (int k = 0; k < 2; k++) {
    own->most[k] = a->row_force_max[0];
    own->secant_at_most[k] = a->secant[k];
    if (own->is_plane) continue;
    own->most[k] = a->force_scale * own->table[k].force_max;
    own->secant_at_most[k] = own->most[k] * own->price_ratio * own->table[k].over_price;
  }
}

/* Reads a robot in the state of a question; 0 where lanes cannot answer it. */
static int read_robot(const real *block, const fl_work *work, const fl_question *q,
                      lanes_robot *robot) {
  if (q->previous || work->span.rank == 0) return 0;
  if (work->has_drag || work->has_turn_cost) return 0;
  robot->block = block;
  robot->work = work;
  robot->n = COUNT(block);
  for (int i = 0; i < robot->n; i++) {
    if (!is_known_kind(block, work, i)) return 0;
    read_actuator(block, work, i, robot->actuator + i);
  }
  return 1;
}

/* Answers one wrench of a batch: budgets are kept by tables there, in every work area alike. */
static int answer_by_tables(const real *block, fl_work *work, const fl_question *q,
                            fl_answer *out) {
  const fl_law_power law_power = work->law_power;
  work->law_power = 0;
  const int code = fl_answer_one(block, work, q, out);
  work->law_power = law_power;
  return code;
}

int fl_answer_many(const real *block, fl_work *work, const fl_question *question, int lanes,
                   const real *wrench, int count, real *force, real *multipliers,
                   real *wrench_served, real *gap_power_bound, real *command,
                   fl_byte *is_attainable, real *error, fl_byte *is_truncated) {
  const answer_arrays answers = {force,         multipliers, wrench_served, command,
                                 is_attainable, error,       is_truncated};
  fl_question q = *question;
  fl_answer out;
  lanes_robot robot;
  const lanes_kernel kernel = kernel_of(lanes);
  memset(is_attainable, 0, (size_t)count);
  if (kernel && count > 1) {
    if (!fl_prepare_question(block, work, &q)) return FL_BAD_NUMBER;
    if (read_robot(block, work, &q, &robot)) {
      const lanes_batch batch = {wrench,       question->multipliers, count,   force,
                                 multipliers,  wrench_served,         command, error,
                                 is_attainable};
      kernel(&robot, &batch);
    }
  }
  for (int k = 0; k < count; k++) {
    gap_power_bound[k] = 0;
    is_truncated[k] = 0;
    if (is_attainable[k]) continue; /* answered in lanes */
    memcpy(q.wrench, wrench + 6 * k, sizeof q.wrench);
    if (question->multipliers) q.multipliers = question->multipliers + 6 * k;
    const int code = answer_by_tables(block, work, &q, &out);
    if (code) return code;
    write_answer_of(block, &out, k, &answers);
    gap_power_bound[k] = out.gap_power_bound;
  }
  return FL_OK;
}
