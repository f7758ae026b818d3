/* What the jets and messages of one robot take at its forces, as kernels of each width of vectors
   evaluate it: interaction_kernel.h has the formulas. */
#ifndef FL_INTERACTION_LANES_H
#define FL_INTERACTION_LANES_H
#include "jets.h"
#include "lanes.h"
#include "messages.h"

#define MOST_FORMULAS 8

/* A model of interaction: a sum of formulas of jets, which differ in their constants alone, and of
   messages whose factors are polynomials of their features. */
typedef struct {
  int formulas;
  const water *formula[MOST_FORMULAS]; /* the first with the outlets behind it */
  real weight[MOST_FORMULAS];
  int profiles;                  /* how many differ in how fast their jets are */
  int profile_of[MOST_FORMULAS]; /* by formula, from 0 on */
  int formula_of[MOST_FORMULAS]; /* by profile, the first one that has it */
  const crowd *messages;         /* 0 for none */
  const real *pair_coefficients; /* of the polynomials that are factors */
  const real *hull_coefficients;
} interaction_model;

/* What the actuators of a robot have from each other. */
typedef struct {
  real change[FL_MOST][3];    /* of each force [N] */
  real by_own[FL_MOST][3][3]; /* its derivatives by the force itself, by whose numbers first */
  real (*slope)[3][6];        /* (n, 3, 6) of the wrench, by the forces; 0 for none */
} interaction_effect;

/* Adds what a model says of forces (n, 3). */
typedef void (*interaction_kernel)(const interaction_model *model, const real *force,
                                   interaction_effect *effect);

void fl_interaction_scalar(const interaction_model *model, const real *force,
                           interaction_effect *effect);
#ifdef HAS_LANES
void fl_interaction_baseline(const interaction_model *model, const real *force,
                             interaction_effect *effect);
#endif
#ifdef HAS_X86_LANES
void fl_interaction_avx2(const interaction_model *model, const real *force,
                         interaction_effect *effect);
void fl_interaction_avx512(const interaction_model *model, const real *force,
                           interaction_effect *effect);
#endif

/* interaction.c: what there is before a model adds to it, with derivatives by forces (n, 3, 6) or 0
   for none. */
void fl_begin_effect(int n, real *slope, interaction_effect *effect);

/* Adds what a model says of forces (n, 3), in as many lanes as its robot's numbers say. */
void fl_add_model(const interaction_model *model, const real *force, interaction_effect *effect);

/* The changes (n, 3) of forces, and their wrench (6,); the derivatives are complete then. */
void fl_finish_effect(const water *w, interaction_effect *effect, real *change, real *offset);

#endif
