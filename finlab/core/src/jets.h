/* Numbers of a robot with jets, as Python writes them: `fl_jets` reads a `water`, then an `outlet`
   for each of its n actuators. */
#ifndef FL_JETS_H
#define FL_JETS_H
#include "internal.h"

#define FLOOR_SHARE R(1e-4) /* squared speed over that of a jet to which its size is rounded off */

typedef struct {
  real n;
  real formula; /* 1 where jets count, else speed alone takes */
  real density;
  real still; /* speed of a jet below which it counts as none [m/s] */
  real lanes; /* how many pairs of actuators are computed at once: fl_widest_lanes of Python's */
  /* The constants. */
  real length, width, spread, lag, most, side, housing, hull, behind, grazing;
  real center[3], half[3]; /* of the ellipsoid that stands for the hull [m]; 0 for none */
} water;

typedef struct {
  real position[3], diameter, advance;
} outlet;

static inline const outlet *outlets_of(const water *w) { return (const outlet *)(w + 1); }

/* Whether jets meet a hull. */
static inline int has_hull(const water *w) {
  return w->formula != 0 && w->half[0] > 0 && w->half[1] > 0 && w->half[2] > 0;
}

#define FAR_BEHIND 14 /* a jet is nothing at so many `behind` upstream of its outlet */
#define FAR_ASIDE 28  /* nor where the exponent of its profile is above that */

/* Whether there is next to nothing of a jet, below ROUNDING of what it is in the middle, so many
   diameters along it and off its axis, squared. */
static inline int is_nothing_of_jet(const water *w, real along, real aside_squared) {
  if (along < -FAR_BEHIND * w->behind) return 1;
  return w->spread * aside_squared > FAR_ASIDE * (along * along + w->width * w->width);
}

typedef struct {
  real thrust;       /* [N] */
  real speed;        /* of the water far behind [m/s] */
  real ahead[3];     /* direction of the force */
  real mass_flow;    /* [kg/s] */
  real per_diameter; /* one over the diameter of its outlet [1/m] */
} jet;

/* How a jet meets an actuator. */
typedef struct {
  int from;            /* whose jet it is */
  real from_outlet[3]; /* way from its outlet, in diameters */
  real along;          /* the same along the jet */
  real speed;          /* [m/s] */
  real slope;          /* of the speed by `along` */
} jet_met;

/* jets.c */
jet fl_jet_of(const water *w, const outlet *from, const real *force);
int fl_jet_meets(const water *w, const outlet *from, const jet *j, const outlet *to, jet_met *met);
real fl_share_on_hull(const water *w, const outlet *from, const real *ahead, real *slope);

/* line_jets.c: the same of actuators that push along lines, at rest in the water. The wrench offset
   (6,) of forces along the laws' axes, and, where wanted, its derivatives (n, 3, 6) by them, of
   which each line has the first alone. */
void fl_jets_of_lines(const fl_coupled_robot *robot, const fl_span *span, real force[][3],
                      real *offset, real slope[][3][6]);

#endif
