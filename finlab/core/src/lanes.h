/* Batches in vector lanes: each lane of a vector answers a target of its own, and all lanes do the
   same arithmetic at once. What stands here is shared by answer_many.c, which prepares a robot for
   lanes and chooses their width, and by the kernels, of which there is one for each width:
   lanes_baseline.c, lanes_avx2.c, lanes_avx512.c.

   Lanes take the common case: outside of ticks, thrusters, pods that push one way, and fins without
   a gauge. A target that they do not finish is left to fl_answer_one: one beyond reach, one whose
   forces may lie in a gap of their sets, one whose commands need steps by the laws.

   FL_NO_LANES leaves vectors out.

   All operations of a lane are those of IEEE 754 in one order, without contraction. So an answer
   has the same bits whatever the width of the vector, and whatever stands in the other lanes. */
#ifndef FL_LANES_H
#define FL_LANES_H
#include "internal.h"

#if defined(__GNUC__) && !defined(FL_SINGLE) && !defined(FL_NO_LANES)
#define HAS_LANES
#if defined(__x86_64__)
#define HAS_X86_LANES
#endif
#endif

/* Numbers of a vector by each kernel. */
enum { LANES_BASELINE = 2, LANES_AVX2 = 4, LANES_AVX512 = 8 };

/* An actuator as lanes read it. Of what there is ahead and in reverse, the first is that ahead. */
typedef struct {
  int kind;          /* of its command: FL_THRUSTER, FL_POD or FL_FIN */
  int is_plane;      /* whether it pushes in a plane */
  int has_reverse;   /* whether a line has another table in reverse */
  int is_one_cell;   /* whether its tables have one cell each */
  real column[2][6]; /* of B: scaled wrench in the basis per newton of each row [1/N] */
  fl_price_table table[2];
  real force_scale; /* k_T of Eq. 16, force over that of the tables */
  real power_scale; /* k_P, the same of power */
  real price_ratio; /* k_T / k_P */
  real force_min;   /* limits of its set [N], and their power [W] */
  real force_max;
  real cost_at_min;
  real cost_at_max;
  int has_arc;              /* whether a plane pushes in some directions only */
  int is_forked;            /* whether both ends of its arc may be worth the same */
  real center[2];           /* direction of the middle of its arc */
  real half[2];             /* cosine and sine of half of the arc */
  real end[2][2];           /* directions of its ends, that of smaller angles first */
  real half_angle;          /* [rad] */
  real price_floor_squared; /* below its root a price has no direction [W^2/N^2] */
  real blend_width;         /* omega of Eq. 25 [W] */
  real price_quadratic;     /* least price that counts in a secant [W/N] */
  real secant_quadratic;    /* |y| / |s| of quadratic costs [N^2/W] */
  real most[2];             /* largest force [N], and its secant there [N^2/W] */
  real secant_at_most[2];
} lanes_actuator;

/* A robot as lanes read it, in the state of one question. */
typedef struct {
  const real *block;
  const fl_work *work;
  int n;
  lanes_actuator actuator[FL_MOST];
} lanes_robot;

/* Targets of a batch, and their answers; see fl_answer_many. */
typedef struct {
  const real *wrench;
  const real *multipliers_first; /* (count, 6) to begin with; 0 for none */
  int count;
  real *force;
  real *multipliers;
  real *wrench_served;
  real *command;
  real *error;
  fl_byte *is_answered; /* becomes whether lanes have answered it */
} lanes_batch;

/* Answers targets of a batch that lanes can answer. */
typedef void (*lanes_kernel)(const lanes_robot *robot, const lanes_batch *batch);
#ifdef HAS_LANES
void fl_lanes_baseline(const lanes_robot *robot, const lanes_batch *batch);
#endif
#ifdef HAS_X86_LANES
void fl_lanes_avx2(const lanes_robot *robot, const lanes_batch *batch);
void fl_lanes_avx512(const lanes_robot *robot, const lanes_batch *batch);
#endif

#endif
