/* The work area of the core, public for its size alone: a program without a heap keeps one in static memory. Its fields may
   change in any version. */
#ifndef FL_WORK_H
#define FL_WORK_H
#include "finlab.h"

/* A table: price of the largest force, cells k, power of the least force; then force, its derivative by the
   price, conjugate at k + 1 prices top (j / k)^4. A gauge: points p; then support function, its derivative,
   the gauge, and the angle from the command's direction to the force's in p directions around the circle. A curve:
   points p; then pairs, the first number ascending. A beat: cells k; then amplitude and frequency of the shares
   (j / k)^2 of the largest force. A grid: see command_law.c. */

typedef struct { /* a foil near to a command: force, by angle, cost, by angle and squared angle */
  fl_real force[2], slope[2], cost, pay, bend;
} fl_tangent;

typedef struct { /* what one actuator may give now */
  fl_real low, high, low_cost, high_cost, middle, half, reverse, reverse_cost;
  fl_real gap2, cos_middle, sin_middle, cos_half, sin_half;
  fl_real turn;     /* kappa: turning by d from `at` costs kappa / 2 d^2 [W/rad^2]; 0 where it costs nothing */
  fl_real at;       /* angle from which it turns, within a turn of `middle` [rad] */
  fl_real steepest; /* where turning costs: largest slope of its force by its price [N^2/W] */
  fl_real cut;      /* where it jumps: angle between the two answers [rad] */
  int flipped, forked;
  int jumps;        /* whether its answer jumps where Newton's method stood still */
  const fl_tangent *tangent; /* of a foil near to a command, whose limits are angles from there; else 0 */
} fl_set;

typedef struct { /* prices, and what they give */
  fl_real price[6], residual[6], force[FL_MOST][2];
  fl_real slope[FL_MOST][4]; /* of forces by prices: xx, xy, yy; then force over price [N^2/W] */
  fl_real angle[FL_MOST];    /* of a plane whose turning costs: angle at which it pushes [rad] */
  fl_real value, size;       /* dual value [W], size of the residual */
} fl_state;

#define FL_POINTS 8              /* of a mixture near to a point out of reach */
/* Cuts on the way to one part of sets with gaps: as many for a robot whatever FL_MOST, so that all who compile the core
   answer alike. */
#define FL_DEPTH_OF(n) (16 + (n))
#define FL_DEPTH FL_DEPTH_OF(FL_MOST)

typedef struct { /* a mixture of points, and an orthonormal basis of their differences from the first one */
  fl_wide force[FL_POINTS][FL_MOST][2], point[FL_POINTS][6], share[FL_POINTS], miss[6]; /* miss: of a target */
  fl_wide along[FL_POINTS]; /* of each point, how much of the ray (0 or 1) it takes */
  fl_wide q[FL_POINTS][6], r[FL_POINTS][FL_POINTS]; /* on the diagonal of r its inverse, 0 where a point depends */
  int count, done; /* points; how many of them the basis knows */
} fl_mixture;

#define FL_SCORES 6
typedef struct { /* a cut on the way to one part of sets with gaps */
  fl_set before;
  fl_real force[2], price[6], score[FL_SCORES]; /* price and score of the side that was not taken first */
  int cut, first, both;                         /* actuator, side taken first, whether the other one was, too */
} fl_node;

typedef struct { /* commands that are allowed */
  fl_real low[FL_MOST][3], high[FL_MOST][3];
  int free[FL_MOST]; /* whether the angle may be any */
} fl_box;

typedef struct { /* what the actuators that work span in the axes that count */
  unsigned char lost[FL_MOST], counts[6];
  fl_real scale[6];              /* wrench = scale * scaled wrench [N, N m] */
  fl_real basis[6][6];           /* 6 x range: directions of scaled wrenches that are driven */
  fl_real matrix[FL_MOST][2][6]; /* scaled wrench in the basis per newton of each row; 0 of a lost actuator */
  fl_real beside[6];             /* wrench on top of that of the forces [N, N m] */
  int range;
} fl_span;

struct fl_work {
  fl_span span;
  int is_whole; /* whether `set` and `box` are those of the robot outside of ticks */
  fl_set set[FL_MOST];
  fl_state state[2], *now; /* what Newton's method looks at, and what it came to */
  fl_mixture mixture;
  fl_node node[FL_DEPTH];
  fl_box box;
  fl_wide column[FL_MOST][2][6]; /* wrench per newton of each row, in weighted axes */
  int corners[FL_MOST];          /* places of polygons that stand for sets; 0 for none */
  fl_real slope[FL_MOST][3][6]; /* wrench over the yardstick by each command, over its width */
  fl_set kept[FL_MOST], best_set[FL_MOST]; /* sets that a search began with, and those of its best part */
  fl_real best[FL_MOST][2];                /* forces of the best part */
  fl_tangent tangent[FL_MOST];
  fl_real full_power[FL_MOST]; /* of each actuator [W] */
  fl_real steepest[FL_MOST];   /* of each pod: largest slope of its force by its price [N^2/W] */
  fl_real begin[6]; /* in a tick: prices in the basis at which the commands before were given */
  int begins;       /* whether there are such prices */
  const fl_real *previous; /* commands of the tick before; 0 for none */
  fl_wide close;           /* distance, on the yardstick, up to which a point is the nearest one */
  const fl_wide *ray;      /* (6,) of which a mixture may take a share, in weighted axes; 0 for none */
  fl_real aim[6], placed[FL_MOST][3], near[6]; /* wrench; commands of the best part where there are foils, prices there */
  fl_real metric[6][6], factor[6][6], least_trace, most_cost;
  int quick, torn, drags, turns, steps, ended;
  int refined;    /* Levenberg-Marquardt steps on commands since whoever asks set it to 0 */
  fl_settings settings;
};

/* How Newton's method ended: the target is met, is beyond reach, or prices stood still. */
enum { FL_MET, FL_BEYOND, FL_STUCK };
#endif
