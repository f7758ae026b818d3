/* Numbers of the messages between actuators, and between each and the hull, as Python writes them:
   a `crowd`, then a `member` for each of its n actuators, then a `pair` for each of those that have
   a message. finlab/interaction/messages.py says what messages are. */
#ifndef FL_MESSAGES_H
#define FL_MESSAGES_H
#include "internal.h"

#define PAIR_FEATURES 11
#define FEATURES_OF_PLACE 6 /* the first ones, of along and squared radius alone */
#define PAIR_VECTORS 4
#define PAIR_NUMBERS (PAIR_FEATURES + 3 * PAIR_VECTORS)
#define PAIR_FORCES 6 /* numbers of two forces: of the source, of the receiver */
#define HULL_FEATURES 7
#define HULL_VECTORS 3
#define HULL_NUMBERS (HULL_FEATURES + 3 * HULL_VECTORS)

/* As in finlab/interaction/messages.py: */
#define SOFTENING R(1e-4)
#define HULL_SOFTENING R(1e-9)
#define GRAZING R(0.2) /* squared offset over which a jet comes off the hull */
#define FAR 4          /* diameters at which a receiver counts as far */

typedef struct {
  real n;
  real pairs;
  real has_hull;
  real half[3];   /* half axes of the hull [m] */
  real mean_half; /* of these */
} crowd;

typedef struct {
  real position[3];      /* [m] */
  real diameter;         /* of its jet [m] */
  real thrust_still;     /* left where there is no force [N] */
  real hull_position[3]; /* in coordinates in which the hull is the unit sphere */
  real normal[3];        /* of the hull there */
  real size_on_hull;     /* feature of its diameter */
} member;

typedef struct {
  real source, receiver; /* indices */
  real way[3];           /* from source to receiver, in diameters of the source */
  real diameter_ratio;   /* of the receiver over the source */
  real log_ratio;        /* its logarithm */
} pair_table;

static inline const member *members_of(const crowd *robot) { return (const member *)(robot + 1); }

static inline const pair_table *pairs_of(const crowd *robot) {
  return (const pair_table *)(members_of(robot) + (int)robot->n);
}

/* The jet of a force: its thrust t and direction a, by which d t = a.dF and
   d a = (dF - a (a.dF)) / t. */
typedef struct {
  real thrust;   /* [N] */
  real ahead[3]; /* shorter than 1 near rest */
} direction;

static inline direction direction_of(const member *a, const real *force) {
  direction made;
  made.thrust = SQRT(dot(force, force, 3) + a->thrust_still * a->thrust_still);
  const real per_thrust = 1 / made.thrust;
  for (int b = 0; b < 3; b++) made.ahead[b] = force[b] * per_thrust;
  return made;
}

#endif
