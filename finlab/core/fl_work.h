/* The work area of the core, public for its size alone: a program without a heap keeps one in
   static memory. Its fields may change in any version. */
#ifndef FL_WORK_H
#define FL_WORK_H
#include "finlab.h"

/* Tables in a block, which fl_actuator names by their offsets.

   Force table: price of the largest force, cells k, power of the least force; then force, its
   derivative by the price, conjugate at k + 1 prices v_max (j / k)^4.
   Gauge table: points p; then support function, its derivative, the gauge, and the angle from the
   command's direction to the force's in p directions around the circle.
   Command table of a fin, its beat: cells k; then amplitude and frequency of the shares (j / k)^2
   of the largest force. Of a foil, its curve: points p; then pairs of lift and angle, the first
   number ascending.
   Law grid: see command_law.c. */

/* A foil near to a command, by its angle and its squared angle. */
typedef struct {
  fl_real force[2];       /* at the command [N] */
  fl_real force_slope[2]; /* its derivative by the angle [N/rad] */
  fl_real cost;           /* at the command [W] */
  fl_real cost_slope;     /* [W/rad] */
  fl_real curvature;      /* of the cost less what the force is worth [W/rad^2] */
} fl_tangent;

/* Angles of a foil that may stall, and its forces there: what it gives where a wrench beyond reach
   is looked for. */
#define FL_ARC_POINTS 96 /* intervals of all its angles */
typedef struct {
  fl_real angle[FL_ARC_POINTS + 1];    /* ascending [rad] */
  fl_real force[FL_ARC_POINTS + 1][2]; /* lift and drag there [N] */
  fl_real middle;                      /* angle around which they lie closer [rad] */
  fl_real half_width;                  /* of these angles [rad] */
} fl_arc;

/* What one actuator may give now. Forces of a plane are sizes, from 0 on. */
typedef struct {
  fl_real force_min;           /* least force [N] */
  fl_real force_max;           /* largest force [N] */
  fl_real cost_at_min;         /* power of the least force [W] */
  fl_real cost_at_max;         /* power of the largest one [W] */
  fl_real sector_center;       /* of the arc of directions [rad] */
  fl_real sector_half_angle;   /* pi for all directions [rad] */
  fl_real cos_center;          /* cosine of sector_center */
  fl_real sin_center;          /* its sine */
  fl_real cos_half_angle;      /* cosine of sector_half_angle */
  fl_real sin_half_angle;      /* its sine */
  fl_real force_max_reverse;   /* of a plane that pushes either way, else 0 [N] */
  fl_real cost_at_max_reverse; /* power of that force [W] */
  fl_real price_floor_squared; /* below its root a price has no direction [W^2/N^2] */
  fl_real turn_cost;           /* kappa: turning by d costs kappa / 2 d^2 [W/rad^2]; 0: nothing */
  fl_real turn_origin;         /* angle from which it turns, within a turn of sector_center [rad] */
  fl_real slope_max;           /* where turning costs: largest slope T' [N^2/W] */
  fl_real jump_angle;          /* where its response jumps: angle between the two [rad] */
  unsigned char is_flipped;    /* whether it pushes in reverse alone */
  unsigned char reverses_straight; /* whether its reverse is against its first axis alone */
  unsigned char is_forked;         /* whether both ends of its arc may be worth the same */
  unsigned char has_jumped; /* whether its response jumps where Newton's method stood still */
  unsigned char arc_first;  /* first point of `arc` that it keeps */
  unsigned char arc_last;   /* last one */
  /* of a foil near to a command, whose limits are angles from there; else 0 */
  const fl_tangent *tangent;
  /* of a foil that may stall, while points beyond reach are looked for; else 0 */
  const fl_arc *arc;
} fl_set;

/* A table of force over price as it is asked most. */
typedef struct {
  int offset;            /* of its first knot in the block */
  fl_real cells;         /* how many */
  fl_real each;          /* 1 / cells */
  fl_real price_max;     /* price of the largest force, and what follows are of the table [W/N] */
  fl_real over_price;    /* 1 / price_max [N/W] */
  fl_real force_max;     /* largest force [N] */
  fl_real conjugate_max; /* conjugate at that price [W] */
} fl_price_table;

/* An actuator that pushes along one direction. */
typedef struct {
  fl_price_table table[2]; /* ahead and in reverse */
  fl_real force_scale[2];  /* k_T of Eq. 16, force over that of the tables; below 0 in reverse */
  fl_real power_scale;     /* k_P, the same of power */
  fl_real price_ratio;     /* k_T / k_P */
  fl_real slope_scale;     /* k_T k_T / k_P, slope over that of the tables */
  fl_real price_quadratic; /* least price that counts in a secant [W/N] */
  int actuator;            /* which one it is */
} fl_line;

/* Whether the processor has vectors of two numbers, by which lines are answered two at a time:
   pairs.h in finlab/core/src. */
#if defined(__SSE2__) || defined(__aarch64__)
#define FL_HAS_VECTORS
#endif
#if defined(__GNUC__) && defined(FL_HAS_VECTORS) && !defined(FL_SINGLE) && !defined(FL_NO_PAIRS)
#define FL_PAIRS_OF_LINES
#define FL_LINES FL_MOST /* lines that are kept */
#else
#define FL_LINES 1
#endif

/* Multipliers, and what they give. */
typedef struct {
  fl_real lambda_reduced[6];   /* [W] */
  fl_real residual[6];         /* r of Eq. 6, reduced */
  fl_real force[FL_MOST][2];   /* y of Eq. 5 [N] */
  fl_real dy_ds[FL_MOST][3];   /* its derivative: xx, xy, yy [N^2/W] */
  fl_real secant[FL_MOST];     /* |y| / |s| of Eq. 9 [N^2/W] */
  fl_real push_angle[FL_MOST]; /* of a plane whose turning costs [rad] */
  fl_real dual_value;          /* g of Eq. 3 [W] */
  fl_real residual_size;       /* |r|, of scaled wrenches */
} fl_state;

#define FL_POINTS 8 /* of a mixture near to a point out of reach */
/* Cuts on the way to one part of sets with gaps: as many for a robot whatever FL_MOST, so that all
   who compile the core answer alike. */
#define FL_DEPTH_OF(n) (16 + (n))
#define FL_DEPTH FL_DEPTH_OF(FL_MOST)

/* Sets of forces with powers, of the library alone (power_sets.c). */
typedef struct fl_power_sets fl_power_sets;

/* A mixture of points, and an orthonormal basis of their differences from the first one. */
typedef struct {
  fl_wide force[FL_POINTS][FL_MOST][2]; /* of each point [N] */
  fl_wide point[FL_POINTS][6];          /* wrenches in weighted axes, over the wrench scale */
  fl_wide weight[FL_POINTS];            /* of each point, their sum 1 */
  fl_wide miss[6];                      /* m, target less mixture, in weighted axes */
  fl_wide ray_share[FL_POINTS];         /* of each point, how much of the ray (0 or 1) it takes */
  fl_wide q[FL_POINTS][6];         /* orthonormal basis of the differences, Q of their QR factors */
  fl_wide r[FL_POINTS][FL_POINTS]; /* R of these; on the diagonal its inverse, 0 where a point
                                      depends on those before */
  int count;                       /* points */
  int actuators;                   /* whose forces a point has */
  int basis_count;                 /* how many of them the basis knows */
} fl_mixture;

#define FL_SCORES 6 /* numbers by which a policy compares parts, the first one first */
/* A cut on the way to one part of sets with gaps. */
typedef struct {
  fl_set set_before;         /* of the actuator, before the cut */
  fl_real force[2];          /* of the actuator, in the gap [N] */
  fl_real lambda_reduced[6]; /* multipliers on the side that was not taken first [W] */
  fl_real score[FL_SCORES];  /* of that side: its dual value [W], or a policy's numbers */
  int actuator;              /* whose set is cut */
  int first_side;            /* side taken first, 1 or -1 as fl_narrow_set has them */
  int has_both_sides;        /* whether the other one was taken, too */
} fl_cut;

/* Commands that are allowed. */
typedef struct {
  fl_real command_min[FL_MOST][3]; /* least numbers of a command, by its kind */
  fl_real command_max[FL_MOST][3]; /* largest ones */
  int is_free_angle[FL_MOST];      /* whether the angle may be any */
} fl_box;

/* What the actuators that work span in the axes that count. */
typedef struct {
  unsigned char is_lost[FL_MOST]; /* 1 of an actuator that does not work */
  unsigned char axis_counts[6];   /* 1 of an axis that has to be met */
  fl_real axis_scale[6];          /* wrench = axis_scale * scaled wrench [N, N m] */
  fl_real basis[6][6];            /* 6 x rank: directions of scaled wrenches that are driven */
  /* columns of B: scaled wrench in the basis per newton of each row; 0 of a lost actuator */
  fl_real effectiveness_reduced[FL_MOST][2][6];
  fl_real wrench_offset[6]; /* wrench beside that of the forces [N, N m] */
  int rank;                 /* of the effectiveness: how many directions are driven */
} fl_span;

/* Multipliers lambda, and 1 + zeta of each bus, at which a target within budgets begins. */
#if FL_KEEPS_BUDGETS
#define FL_BUDGET_TARGETS 8 /* the wrench itself, a policy's groups, and what is closest */
#else
#define FL_BUDGET_TARGETS 1
#endif
typedef struct {
  fl_real lambda[6];
  fl_real factor[FL_BUSES];
} fl_budget_begin;

/* Gives the power of an actuator by its law at a command (3,) [W]. */
typedef fl_real (*fl_law_power)(const fl_work *work, int i, const fl_real *command);

struct fl_work {
  fl_span span;         /* of this question */
  int is_whole;         /* whether `set` and `box` are those of the robot outside of ticks */
  fl_set set[FL_MOST];  /* of each actuator, as a search has cut it */
  fl_box box;           /* of this question */
  fl_settings settings; /* that bound searches */

  fl_line line[FL_LINES]; /* all lines of the robot, where they are answered in pairs */
  int line_count;         /* how many there are */
  int has_line_cells;     /* whether one has a table of several cells */

  /* Newton's method. */
  fl_state state[2];            /* the one so far, and a trial */
  fl_state *state_found;        /* which of these it came to */
  fl_real metric[6][6];         /* M of Eq. 8 */
  fl_real hessian_factor[6][6]; /* of quadratic costs, L D L' */
  fl_real trace_min;            /* trace below which G_mu of Eq. 8 is singular */
  fl_real power_cost_max;       /* C of Eq. 13 [W] */
  fl_real residual_enough;      /* of scaled wrenches, at which a target is met */
  fl_real power_of_use;         /* dual value above which an answer is of no use [W] */
  int is_convex;                /* whether no set has a gap or a kink */
  int has_forks;                /* whether one is forked, or pushes either way */
  int has_zones;                /* whether a pod has barred zones between its arcs */
  int has_drag;                 /* whether a foil drags */
  int has_turn_cost;            /* whether turning costs */
  fl_real over_cost[FL_MOST];   /* 1 / (1 + zeta) of the bus of each actuator, by which prices
                                   count in searches within power budgets; else 1 */
  fl_budget_begin budget_begin[FL_BUDGET_TARGETS]; /* where targets within budgets ended */
  int budget_begins;                               /* how many of these are of this question */
  int is_budget_too_small;           /* whether the first of them is proved to be beyond */
  unsigned char bus_binds[FL_BUSES]; /* 1 of a bus that would give more if it had more */
  fl_law_power law_power; /* of fl_use_laws, and what it reads; 0 where tables say powers */
  const fl_formula *laws;
  const void *curves; /* an array of fl_real pointers */
  int has_kinks;      /* whether one of these is so of a question, or a plane cannot rest */
  int newton_steps;   /* of this question */
  int is_truncated;   /* whether a search ended at its bound of steps */

  /* Points of the attainable set near to a wrench out of reach. */
  fl_mixture mixture;                            /* that comes nearest */
  fl_wide effectiveness_weighted[FL_MOST][2][6]; /* wrench per newton of each row, weighted axes */
  fl_wide axis_weight[6];                        /* of these axes [1] */
  int polygon_offset[FL_MOST];                   /* of polygons that stand for sets; 0 for none */
  fl_real rim_normal[6];   /* outer normal of the attainable set there, in the basis */
  int is_rim_exact;        /* whether point and normal are known to rounding */
  fl_wide distance_enough; /* over the wrench scale, up to which a point is the nearest one */
  const fl_wide *ray; /* (6,) of which a mixture may take a share, in weighted axes; 0 for none */
  fl_power_sets *power_sets; /* within whose budgets fl_reach_within asks; 0 for none */

  /* Sets with gaps. */
  fl_cut cut[FL_DEPTH]; /* cuts on the way to the part that is looked at */
  /* Sets that a search began with. Two searches keep theirs here, never at the same time:
     fl_search_gaps while it runs, and fl_out_of_reach until it has put its own back, after which it
     may call fl_search_gaps. */
  fl_set set_before[FL_MOST];
  fl_set best_set[FL_MOST];         /* of the best part, of fl_out_of_reach alone */
  fl_real best_force[FL_MOST][2];   /* of the best part [N] */
  fl_real best_command[FL_MOST][3]; /* of the best part where there are foils */
  fl_real best_lambda[6];           /* reduced multipliers near these commands [W] */

  /* Commands. */
  fl_real jacobian[FL_MOST][3][6]; /* J of Eq. 11 over the wrench scale and widths of the box */
  fl_tangent tangent[FL_MOST];     /* of each foil, at the commands of a step */
  fl_real wrench_wanted[6];        /* that the commands are to give [N, N m] */
  int refine_steps; /* Levenberg-Marquardt steps on commands since whoever asks set it to 0 */

  /* Ticks. */
  const fl_real *command_previous; /* commands of the tick before; 0 for none */
  fl_real lambda_begin[6];         /* reduced multipliers at which these were given [W] */
  int has_lambda_begin;            /* whether there are such multipliers */
  fl_real power_max[FL_MOST];      /* of each actuator [W] */
  fl_real slope_max[FL_MOST];      /* of each pod: largest slope T' [N^2/W] */

#if FL_ARCS > 0
  fl_arc arc[FL_ARCS]; /* of foils that may stall */
#endif
};

/* How Newton's method ended: fl_answer.newton_status. */
enum {
  FL_MET,        /* the target is met */
  FL_BEYOND,     /* it is proved to be beyond reach, Eq. 13 */
  FL_NO_PROGRESS /* steps end short of the target, or come to their bound */
};
#endif
