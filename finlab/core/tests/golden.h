/* What the tests of the core share: golden robots, and checks that say where they fail. */
#ifndef GOLDEN_H
#define GOLDEN_H
#include "finlab.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#ifdef FL_SINGLE
static const double met = 1e-5; /* error of commands over the wrench scale */
#else
static const double met = 2e-8;
#endif
static const double optimal = 1e-3; /* share by which a thin table, and an oracle, may be off */
/* The same of the power of sets with gaps, of which the oracle cuts other ones. */
static const double optimal_with_gaps = 1e-2;

typedef struct {
  fl_real within[6]; /* a wrench within reach [N, N m] */
  double power;      /* least power for it [W], by an oracle */
  fl_real beyond[6]; /* a wrench out of reach */
  double ray_share;  /* largest share of it that can be given, by an oracle */
  double miss;       /* least distance from it over the wrench scale, by an oracle */
} golden_question;

typedef struct {
  const char *name;
  const fl_real *block;
  int length;
  const golden_question *questions;
  int count;
  const fl_real (*effectiveness)[6]; /* of each direction of each actuator */
  int has_no_gaps;                   /* whether the dual value is the least power itself */
} golden_robot;

static int failures;

#define CHECK(condition, name, index)                                                      \
  do {                                                                                     \
    if (!(condition)) {                                                                    \
      failures++;                                                                          \
      printf("%s:%d: %s does not hold (%s, %d)\n", __FILE__, __LINE__, #condition, (name), \
             (int)(index));                                                                \
    }                                                                                      \
  } while (0)

static const fl_head *head_of(const fl_real *block) { return (const fl_head *)(const void *)block; }

static const fl_actuator *actuators_of(const fl_real *block) {
  return (const fl_actuator *)(const void *)(head_of(block) + 1);
}

/* Distance between two wrenches over a robot's wrench scale. */
static inline double distance(const fl_real *block, const fl_real *a, const fl_real *b) {
  double squared = 0;
  for (int k = 0; k < 6; k++) {
    const double apart = ((double)a[k] - (double)b[k]) / (double)head_of(block)->wrench_scale[k];
    squared += apart * apart;
  }
  return sqrt(squared);
}

#endif
