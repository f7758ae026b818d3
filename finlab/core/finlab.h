/* Control allocation in C99: commands of least power for a desired wrench. No heap, no library but
   math.h.

   A robot is one block of constant numbers, which Python compiles; its fields are in fl_fields.h.
   All that changes lies in a work area, `fl_work`, one for each thread. The calls:

     static fl_work work;
     static fl_answer answer;
     int code = fl_check(block, length);                 once, of a block that somebody else made
     if (!code) code = fl_prepare(block, &work);         once
     fl_question question = {.wrench = {1, 0, 0, 0, 0, 0}};
     if (!code) code = fl_answer_one(block, &work, &question, &answer);
     if (code) puts(fl_error_text(code));

   Units are SI; wrenches (Fx, Fy, Fz, Tx, Ty, Tz) are in the body frame, x forward, y left, z up.
   docs/theory/method.md has the mathematics, docs/theory/glossary.md the names: the wrench is met
   at multipliers lambda, to which each actuator responds with the force that is worth most there
   (Eq. 5); Newton's method finds the lambda at which the responses add up to the wrench (Eq. 8). */
#ifndef FINLAB_H
#define FINLAB_H
#include "fl_names.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifdef FL_SINGLE
typedef float fl_real;
#else
typedef double fl_real;
#endif
typedef double fl_wide; /* where differences of large numbers matter, in single precision, too */

#ifndef FL_MOST
#define FL_MOST 256 /* most actuators of a robot */
#endif
#ifndef FL_ARCS
#define FL_ARCS 16 /* most foils that may stall beyond reach; others keep to their tables */
#endif
#ifndef FL_ZONES
#define FL_ZONES 4 /* most barred zones of a pod; exports of robots without any have 0 */
#endif
#ifndef FL_SLIPSTREAMS
#define FL_SLIPSTREAMS 1 /* whether rudders in slipstreams are known; exports without any have 0 */
#endif
#ifndef FL_GAUGES
#define FL_GAUGES 1 /* whether a force may differ by direction; exports without such have 0 */
#endif
#ifndef FL_COUPLES
#define FL_COUPLES 1 /* whether actuators may act on each other; exports of others have 0 */
#endif
#ifndef FL_AIMS
#define FL_AIMS 1 /* whether pods or fins turn; exports of robots without any have 0 */
#endif
#ifndef FL_KEEPS_BUDGETS
#define FL_KEEPS_BUDGETS 1 /* whether power budgets are kept; exports without any have 0 */
#endif
#define FL_BUSES 8 /* most buses whose power is limited */
#ifndef FL_PARTS
#define FL_PARTS 1000 /* the usual fl_settings.most_parts */
#endif

/* Bounds of loops. From these follows the time that an answer takes at most. */
#define FL_STEPS 200          /* steps of Newton's method to a target */
#define FL_STEPS_AT_KINK 60   /* the same where sets have kinks or gaps, or at the rim */
#define FL_DIVE_ROUNDS 12     /* in which a search leaves all gaps on their nearer sides */
#define FL_FOIL_STEPS 12      /* steps that make commands of foils cheaper, each a target */
#define FL_FOIL_VERTICES 64   /* vertices of foils' lifts from which commands are made cheaper */
#define FL_LATTICE_STARTS 60  /* points of a lattice of foils' angles at which steps begin */
#define FL_LATTICE_FOLLOWED 6 /* of these that are made cheaper */
#define FL_RAY_SHARES 24      /* shares of a ray that are tried where foils drag */

/* Most steps of Newton's method (fl_answer.newton_steps) of one answer by the usual settings.

   FL_DIVE    a search for least power leaves all gaps at once, solved anew in each round
   FL_SEARCH  two dives before the first cut; then for each part its dive and two targets: a cut
              makes two parts, whose sides take two targets, one more to go back to the cheaper
              side, and one when the other is taken up. Cuts come in twos, so that FL_PARTS + 1
              parts are looked at
   FL_FORCES  forces for a wrench: its target and a search; beyond reach three targets at the rim,
              one for what is served there, and another search
   FL_STARTS  where foils drag, commands of one search that are made cheaper: those of each part
              and of the first dive, of vertices of lifts, of both ends of each foil's angles, of
              first multipliers, and of points of a lattice; beyond reach those that come nearest
   FL_FOILS   steps for these: of two searches, and twice for each share of a ray (begun at the last
              commands and anew); and a target for each start of a lattice
   FL_BUDGETS targets within power budgets: the wrench itself, each group of a policy, and what is
              closest, at up to ten costs of what is missing, and in a search each part at up to
              two; for each correction by the laws anew; and in a tick forces at twelve costs of
              turning
   FL_BOUND   forces are found twice in a tick in which drives pass their dead bands */
#define FL_DIVE (FL_DIVE_ROUNDS * FL_STEPS_AT_KINK)
#define FL_SEARCH (2 * FL_DIVE + (FL_PARTS + 1) * (FL_DIVE + 2 * FL_STEPS_AT_KINK))
#define FL_FORCES (2 * (FL_STEPS + FL_SEARCH) + 3 * FL_STEPS_AT_KINK)
#define FL_STARTS (FL_PARTS + 5 + FL_FOIL_VERTICES + 2 * FL_MOST + FL_LATTICE_FOLLOWED)
#define FL_FOILS_CHEAPER (FL_FOIL_STEPS * FL_STEPS_AT_KINK * 2 * (FL_STARTS + FL_RAY_SHARES))
#define FL_FOILS (FL_FOILS_CHEAPER + 2 * FL_LATTICE_STARTS * FL_STEPS_AT_KINK)
#define FL_BUDGET_TARGET (10 * FL_STEPS + 2 * FL_STEPS * (FL_SEARCH / FL_STEPS_AT_KINK))
#define FL_BUDGET_TRIES 9 /* the first one, and as many corrections by the laws */
#define FL_BUDGETS (FL_KEEPS_BUDGETS * (FL_BUDGET_TRIES * 8 * FL_BUDGET_TARGET + 12 * FL_FORCES))
#define FL_BOUND (2 * (FL_FORCES + FL_FOILS) + FL_BUDGETS)

#define FL_VERSION 30  /* of all structs and functions here */
#define FL_MAGIC 41721 /* first number of a block */

/* The structs that cross the border of the library. */
typedef unsigned char fl_byte;
typedef const fl_byte *fl_bytes;
typedef const fl_real *fl_reals;
typedef const struct fl_policy *fl_policy_at;
typedef const struct fl_budget *fl_budget_at;
typedef const struct fl_question *fl_question_at;
typedef struct fl_work *fl_work_at;
typedef fl_real *fl_row_at;
typedef const struct fl_coupled_robot *fl_coupled_at;
typedef const int *fl_flag_at;

/* The wrench offset of actuators that act on each other, o of Eq. 18.

   @param constants  what the function works with
   @param force      (count, n, 3) of the actuators [N], body frame
   @param count      how many questions
   @param inflow     (count, n, 3) velocities of their positions through the water [m/s]; 0 at rest
   @param change     becomes what each actuator's force changes by (count, n, 3) [N]
   @param offset     becomes the offsets (count, 6) [N, N m]
   @param slope      becomes their derivatives by the forces (count, n, 3, 6); 0 for none */
typedef void (*fl_offset_at)(const fl_real *constants, const fl_real *force, int count,
                             const fl_real *inflow, fl_real *change, fl_real *offset,
                             fl_real *slope);

/* clang-format off */
#define FL_BEGIN(type) typedef struct type type; struct type {
#define FL_FIELD(type, name, shape, unit, meaning) type name shape;
#define FL_END(type) };
/* clang-format on */
#include "fl_fields.h"
#undef FL_BEGIN
#undef FL_FIELD
#undef FL_END

/* Kinds of commands: fl_actuator.command_kind. */
enum {
  FL_THRUSTER, /* a force */
  FL_POD,      /* an angle and a force */
  FL_FIN,      /* amplitude, frequency and direction of a beat */
  FL_FOIL,     /* an angle */
  FL_STEERED,  /* deflection of a rudder, and the force of the propeller before it */
  FL_KINDS     /* how many kinds there are */
};

/* Laws that are formulas: fl_formula.kind. */
enum {
  FL_DRAG,              /* of a fin: T = c f^2 sin^2 A */
  FL_LIGHTHILL,         /* of a fin: T = c f^2 A J1(A) */
  FL_SOFT,              /* of a fin that saturates, and then declines */
  FL_FIXED_PROPELLER,   /* a force along an axis, power c |F|^e */
  FL_TURNING_PROPELLER, /* the same at an angle */
  FL_FORMULAS           /* how many there are */
};

/* What to give for a wrench beyond reach: fl_policy.kind. */
enum {
  FL_CLOSEST,   /* the nearest wrench by the weights of the axes */
  FL_DIRECTION, /* the largest share of the wrench */
  FL_PRIORITY,  /* groups of axes, one after the other */
  FL_FALLING,   /* the nearest wrench that gives along some axes no more; by FL_WITH_FALLING */
  FL_POLICIES   /* how many policies there are */
};

/* What functions return; fl_error_text has a sentence for each. */
enum {
  FL_OK,           /* all is well */
  FL_BAD_BLOCK,    /* no robot of this library */
  FL_BAD_VERSION,  /* a block of another FL_VERSION */
  FL_BAD_NUMBER,   /* of a robot: not finite, or out of its range */
  FL_BAD_ARGUMENT, /* of a question or of settings: the same */
  FL_OVER_BUDGET,  /* of an export's short call: commands are given, but take too much power */
  FL_ERRORS        /* how many codes there are */
};

/* What else fl_answer_into_row returns, without an error. */
enum { FL_UNFINISHED = FL_ERRORS, FL_BEYOND_REACH };

/* Everything that changes while a question is answered; see fl_work.h. */
typedef struct fl_work fl_work;

/* @return FL_VERSION of the compiled library. */
int fl_version(void);

/* @param code  what another function returned
   @return      a sentence that says what is wrong and what to do */
const char *fl_error_text(int code);

/* @return all fields of the structs as text, a struct a line:
           "fl_head fl_real magic;... fl_real wrench_scale[6];...". Who reads a block or an answer
           in another language asks the library that he has loaded. */
const char *fl_fields(void);

/* The constants of this header by name, such as FL_FIN, and bytes of structs, such as
   "sizeof fl_work": who calls from another language asks for them, too.

   @param k  from 0 on
   @return   name of a constant, 0 behind the last one; its value, 0 there */
const char *fl_constant_name(int k);
int fl_constant_value(int k);

/* Checks a block before it is used: its version, its tables, its ranges.

   @param block   numbers of a robot
   @param length  how many there are
   @return        FL_OK, FL_BAD_BLOCK, FL_BAD_VERSION or FL_BAD_NUMBER */
int fl_check(const fl_real *block, int length);

/* Prepares a work area for a robot, with the usual settings.

   @param block  numbers that fl_check has passed
   @param work   any bytes
   @return       FL_OK or FL_BAD_NUMBER */
int fl_prepare(const fl_real *block, fl_work *work);

/* @param settings  becomes the usual one */
void fl_usual_settings(fl_settings *settings);

/* @param work      a prepared work area
   @param settings  what bounds its searches from now on
   @return          FL_OK, or FL_BAD_ARGUMENT where a number is below 0 */
int fl_use_settings(fl_work *work, const fl_settings *settings);

/* Finds commands for one wrench: of least power where it is within reach, by the policy where it is
   not.

   @param block     numbers of a robot
   @param work      its prepared work area
   @param question  wrench, policy, commands before, losses, free axes
   @param answer    becomes forces, commands, multipliers and errors
   @return          FL_OK; FL_BAD_ARGUMENT where a number of the question is not finite or out of
                    range, such as the NaN of an estimator; FL_BAD_NUMBER where the robot cannot
                    work with it */
int fl_answer_one(const fl_real *block, fl_work *work, const fl_question *question,
                  fl_answer *answer);

/* Finds commands for one wrench, and writes the answer as a row of numbers: an fl_answer_row, then
   commands (n, 3), forces (n, 2) [N], and in a tick the commands before (n, 3), which the question
   may have there already.

   @param most_error  error up to which commands are exact; below 0 where the grids of the laws
                      cannot tell
   @param row         becomes the answer
   @return            FL_OK where the wrench is within reach, and the commands are exact;
                      FL_BEYOND_REACH where they are the best beyond reach, commands of lost
                      actuators being NaN in both cases; FL_UNFINISHED where steps by the laws
                      themselves may be better, or the search ended early; else as fl_answer_one */
int fl_answer_into_row(const fl_real *block, fl_work *work, const fl_question *question,
                       fl_real most_error, fl_real *row);

/* Single questions as a function of Python, which is called without ctypes: prepared_call.c. */

/* @return names of the functions of Python's C API that it calls, each with a space behind it */
const char *fl_python_names(void);

/* @param functions  addresses of these functions
   @param objects    addresses of None, True, False, and of the types float, int, list, tuple and
                     numpy.ndarray */
void fl_use_python(const void *functions, const void *objects);

/* @return the `PyMethodDef` of a function answer(wrench, previous, multipliers), to be bound to a
           list: address of an fl_prepared_call, type of an answer (a tuple of memory, row, is_met,
           is_finished, command), memory of the rows, their commands (row_count, n, 3), and a
           function that allocates other rows. It returns None where it does not answer. */
const void *fl_python_method(void);

/* @return how many lanes the widest vectors of this machine have that fl_answer_many knows; 1 where
           it knows none. Asking the processor may take microseconds: ask once. */
int fl_widest_lanes(void);

/* Finds commands for many wrenches, all else as in a question, whose multipliers are (count, 6)
   here. The outputs are those of fl_answer, to rounding, and their bits depend neither on `lanes`,
   from 2 on, nor on the other wrenches.

   @param lanes            how many wrenches are answered at once where that can be: 2, 4 or 8, no
                           more than fl_widest_lanes(); 1 for one after the other
   @param wrench           (count, 6) desired [N, N m]
   @param force            (count, n, 2) [N]
   @param multipliers      (count, 6) lambda of the wrenches [W/N, W/(N m)]
   @param wrench_served    (count, 6) wrenches that the forces give [N, N m]
   @param gap_power_bound  (count,) power that gaps are proved to need [W]
   @param command          (count, n, 3)
   @param is_attainable    (count,) whether a wrench is within reach
   @param error            (count,) distance of the commands' wrench from the one served, over the
                           wrench scale
   @param is_truncated     (count,) whether a search ended at its bound of parts or steps
   @return                 as fl_answer_one, of the first wrench that has no answer */
int fl_answer_many(const fl_real *block, fl_work *work, const fl_question *question, int lanes,
                   const fl_real *wrench, int count, fl_real *force, fl_real *multipliers,
                   fl_real *wrench_served, fl_real *gap_power_bound, fl_real *command,
                   fl_byte *is_attainable, fl_real *error, fl_byte *is_truncated);

/* Finds commands for forces.

   @param force     (count, n, 2) [N]
   @param previous  (n, 3), whose angles are kept where there is no force; 0 for none
   @param command   (count, n, 3) */
void fl_commands(const fl_real *block, fl_work *work, const fl_real *force, int count,
                 const fl_real *previous, fl_real *command);

/* Evaluates the laws of all actuators, as far as tables say them.

   @param command  (count, n, 3)
   @param force    becomes the forces (count, n, 3) along the axes of the laws [N] */
void fl_forces_of_commands(const fl_real *block, const fl_real *command, int count, fl_real *force);

/* Evaluates what a command gives and takes, where the laws of all actuators are formulas.

   @param laws           (n,) of the actuators
   @param n              how many actuators there are
   @param effectiveness  (n, 3, 6) wrench per newton along own axes [1, m]
   @param frames         (n, 3, 3) own axes in the body frame, in rows
   @param command        (n, 3), NaN of lost actuators, which give and take nothing
   @param figures        become (6 n + 7,): forces (n, 3) along own axes and in the body frame [N],
                         wrench (6,) [N, N m], and power [W]
   @return               FL_OK, or FL_BAD_ARGUMENT where a command is neither finite nor lost */
int fl_figures_of_command(const fl_formula *laws, int n, const fl_real *effectiveness,
                          const fl_real *frames, const fl_real *command, fl_real *figures);

/* Has budgets be kept by the laws of all actuators, from now on.

   @param work    a prepared work area
   @param laws    (n,) of the actuators
   @param curves  (n,) of a propeller whose power was measured its curve, else 0: K, then at K
                  rising forces these [N], powers [W] and marginal costs [W/N], which are linear
                  between; of it the law has kind and dead band alone */
void fl_use_laws(fl_work *work, const fl_formula *laws, const fl_real *const *curves);

/* Evaluates the conjugates of all costs at multipliers of the wrench, Eq. 4, for proofs of a lower
   bound of the power.

   @param question    what limits the sets of forces; its wrench is not read
   @param multipliers (count, 6) lambda [W/N, W/(N m)]
   @param margins     (n), for each actuator 0, or how far the conjugate of its law may be above
                      that of its table: price_max of the largest force [W/N], N and M; by how much
                      the law may give less than the table's least force [N]; the largest difference
                      at prices between price_max (j / N)^4 and the next (N) [W]; and beyond them
                      the difference over the price, at price_max / (1 - j / M) (M + 1) [N]. Or of a
                      propeller without a dead band: -1, then c ahead and c in reverse [W], and e
                      [1] of its law P = c |F|^e, whose own conjugate it is then
   @param conjugates  becomes those of each actuator (count, n), of one with a margin an upper bound
                      of that of its law over all that its limits allow, rates left out
   @return            FL_OK or FL_BAD_NUMBER */
int fl_conjugates(const fl_real *block, fl_work *work, const fl_question *question,
                  const fl_real *multipliers, int count, const fl_real *const *margins,
                  fl_actuator_conjugate *conjugates);

/* Proves lower bounds of the power that wrenches need, Eq. 3, where all actuators have margins.

   @param question    what limits the directions of forces; its wrench is not read
   @param multipliers (count, 6) lambda [W/N, W/(N m)]; any prove a bound
   @param wrench      (count, 6) that is given [N, N m], 0 along axes that do not count
   @param margins     (n), as in fl_conjugates, none of them 0
   @param bound       becomes the larger one of the bounds at these multipliers and at 0 (count) [W]
   @return            FL_OK or FL_BAD_NUMBER */
int fl_power_bounds(const fl_real *block, fl_work *work, const fl_question *question,
                    const fl_real *multipliers, const fl_real *wrench, int count,
                    const fl_real *const *margins, fl_real *bound);

/* Does the same for one answer, at its own multipliers and for the wrench of its command.

   @param call          with which it was asked
   @param laws          (n,) of the actuators, as in fl_figures_of_command
   @param effectiveness (n, 3, 6) wrench per newton along own axes [1, m], 0 along axes that do not
                        count
   @param margins       as in fl_power_bounds
   @param row           of fl_answer_into_row
   @return              the bound [W]; -1 where it is not found here: gaps need power, too, or the
                        work area is busy */
fl_real fl_power_bound_of_row(const fl_prepared_call *call, const fl_formula *laws,
                              const fl_real *effectiveness, const fl_real *const *margins,
                              const fl_real *row);

/* Says how far rays go in the wrenches that robots of planes give.

   @param sets    (count, n, 16): offset of a polygon's corners, or 0 and radius, centre and half
                  angle of a sector [N, rad]; then the wrench per newton along both directions
   @param from    (count, 6) where the rays begin
   @param ray     (count, 6)
   @param close   distance from the end of a ray up to which a point is there, in the unit of
                  `from` and `ray`; the largest number for one step
   @param size    (count,) lengths over those of the rays
   @param normal  (count, 6) of the supporting planes
   @param force   (count, n, 2) at the ends [N] */
void fl_reach(const fl_real *block, fl_work *work, const fl_real *sets, const fl_wide *from,
              const fl_wide *ray, int count, fl_wide close, fl_wide *size, fl_wide *normal,
              fl_real *force);

#ifdef FL_WITH_POWER_SETS
/* Says the same within power budgets of buses.

   @param tables     corners and curves of the sides, one behind the other; the first number is
                     not used
   @param sides      (., 8): sets of forces and their powers, fl_power_side of internal.h
   @param budget     (buses,) the most power of each bus [W]
   @param buses      how many, FL_BUSES at most
   @param sets       (count, n, 16): of each actuator its first side and how many it has, of which
                     any may be taken, its bus or -1, whether it works; then the wrench per newton
   @param corners    a number for each side, 0 at first, for this function alone
   @param multiplier (count, buses) of the budgets at the planes, in the unit of `from` over W */
void fl_reach_within(const fl_real *block, fl_work *work, const fl_real *tables,
                     const fl_real *sides, const fl_real *budget, int buses, const fl_real *sets,
                     const fl_wide *from, const fl_wide *ray, int count, fl_wide close,
                     int *corners, fl_wide *size, fl_wide *normal, fl_real *force,
                     fl_wide *multiplier);
#endif

/* Takes some steps of Newton's method on the dual from given multipliers, and evaluates it there.

   @param question    losses, free axes and limits; the rest does not count
   @param wrench      (count, 6) desired [N, N m]
   @param most_steps  most steps, those included that are undone; 0 for the dual as it is
   @param multipliers (count, 6) lambda of the wrenches to begin with [W/N, W/(N m)], rows of NaN
                      for its own; becomes those that the steps come to
   @param steps       becomes how many steps were taken (count,)
   @param residual    becomes what the responses leave there of each wrench (count, 6) [N, N m],
                      Eq. 6, of what the actuators span
   @param dual_value  becomes the dual values (count,) [W], Eq. 3
   @param force       becomes the responses (count, n, 2) [N], Eq. 5
   @param slope       becomes their derivatives by the prices xx, xy, yy (count, n, 3) [N^2/W]
   @return            FL_OK; FL_BAD_ARGUMENT where a number is not finite or out of range;
                      FL_BAD_NUMBER as fl_answer_one */
int fl_dual_points(const fl_real *block, fl_work *work, const fl_question *question,
                   const fl_real *wrench, int count, int most_steps, fl_real *multipliers,
                   int *steps, fl_real *residual, fl_real *dual_value, fl_real *force,
                   fl_real *slope);

/* Evaluates the dual at multipliers, in the state (losses, free axes, limits) of the last question.

   @param wrench          (6,) [N, N m]
   @param lambda_reduced  (6,) multipliers in reduced coordinates [W]
   @param force           becomes the responses (n, 2) [N]
   @return                the dual value for the wrench [W], Eq. 3 */
fl_real fl_dual_value(const fl_real *block, fl_work *work, const fl_real *wrench,
                      const fl_real *lambda_reduced, fl_real *force);

/* Finds commands of a robot whose actuators act on each other, in outer iterations: the dual's
   answer on the model made linear at the last forces, and steps on the whole model.

   @param robot     what its actuators do to each other
   @param block     a copy of robot->block_uncoupled, which becomes the linear model
   @param work      work area, prepared for that block
   @param question  as for fl_answer_one, with multipliers to begin with
   @param limits    when the iterations end
   @param force     (n, 2) where they begin, unless the question has commands of the tick before
                    [N]; becomes what they come to
   @param answer    becomes the last answer of the dual by which the commands got better, with
                    these commands; untouched where most_iterations is 0
   @param result    becomes what the iterations end with
   @return          as fl_answer_one */
int fl_outer_iterations(const fl_coupled_robot *robot, fl_real *block, fl_work *work,
                        const fl_question *question, const fl_outer_limits *limits, fl_real *force,
                        fl_answer *answer, fl_outer_result *result);

/* Finds commands of a robot whose actuators act on each other, by outer iterations from several
   starts; in a tick from the commands before alone.

   @param robot     what its actuators do to each other, and where iterations begin anew
   @param block     a copy of robot->block_uncoupled, which becomes the linear model
   @param work      work area, prepared for that block
   @param question  as for fl_answer_one
   @param answer    becomes the last answer of the dual by which the best commands were found, with
                    these commands
   @param result    becomes what their iterations end with
   @return          as fl_answer_one */
int fl_answer_coupled(const fl_coupled_robot *robot, fl_real *block, fl_work *work,
                      const fl_question *question, fl_answer *answer, fl_outer_result *result);

/* The same, and writes the answer as a row of numbers, as fl_answer_into_row does. */
int fl_answer_coupled_into_row(const fl_coupled_robot *robot, fl_real *block, fl_work *work,
                               const fl_question *question, fl_real most_error, fl_real *row);

/* The same for many wrenches, all else as in a question. The outputs are those of fl_answer_many,
   but for bounds of gaps: nothing is proved of these. */
int fl_answer_coupled_many(const fl_coupled_robot *robot, fl_real *block, fl_work *work,
                           const fl_question *question, const fl_real *wrench, int count,
                           fl_real *force, fl_real *multipliers, fl_real *wrench_served,
                           fl_real *command, fl_byte *is_attainable, fl_real *error,
                           fl_byte *is_truncated);

/* The wrench offset of jets, an fl_offset_at.

   @param constants  of the water, then of each actuator; finlab/core/src/jets.c has their order */
void fl_jets(const fl_real *constants, const fl_real *force, int count, const fl_real *inflow,
             fl_real *change, fl_real *offset, fl_real *slope);

/* Prepares jets of a robot whose actuators all push along lines, at rest in the water: a tenth of
   the time of fl_jets, for fl_coupled_robot.line_jets.

   @param robot    all of it but these
   @param numbers  become fl_line_jets_length(robot) numbers, which is 0 for robots of another
                   kind */
int fl_line_jets_length(const fl_coupled_robot *robot);
void fl_prepare_line_jets(const fl_coupled_robot *robot, fl_real *numbers);

/* The wrench offset of an interaction that is linear in its weights, an fl_offset_at.

   @param constants  of the formula of jets, of messages and of their weights;
                     finlab/core/src/linear_interaction.c has their order */
void fl_linear_interaction(const fl_real *constants, const fl_real *force, int count,
                           const fl_real *inflow, fl_real *change, fl_real *offset, fl_real *slope);

/* A body that swims, and fins that follow their commands: what a simulation steps many times, and
   no allocation needs. finlab/swim/vehicle has the equations; a state of a body is position (3) in
   the world, quaternion (4), velocity and angular rates (6) in the body frame. */

/* @param body   numbers of a body in water; finlab/core/src/vehicle.c has their order
   @param state  (13,)
   @param tau    wrench (6,) in the body frame [N, N m]
   @param rates  becomes the rate of change (13,) of the state */
void fl_body_rates(const fl_real *body, const fl_real *state, const fl_real *tau, fl_real *rates);

/* @param body   as for fl_body_rates
   @param state  (13,)
   @return       the fastest rate at which damping, Munk's moments or turning change the motion
                 [1/s] */
fl_real fl_body_fastest_rate(const fl_real *body, const fl_real *state);

/* Says into how many equal parts a step is cut so that integrating it stays stable.

   @param body   as for fl_body_rates
   @param state  (13,) at the beginning
   @param step   its length [s]
   @return       how many, or 0 where the motion is too fast */
int fl_body_parts(const fl_real *body, const fl_real *state, fl_real step);

/* Moves a body over steps by Runge-Kutta of order 4, each cut into as many parts as stay stable.

   @param body    as for fl_body_rates
   @param wrench  (count, 6) in the body frame, which the body carries along in each step [N, N m]
   @param step    length of a step [s]
   @param states  (count + 1, 13): the first is where it begins; the others become those after
                  each step
   @return        how many steps were taken: fewer than count where the motion is too fast */
int fl_body_steps(const fl_real *body, const fl_real *wrench, int count, fl_real step,
                  fl_real *states);

/* Moves a body over one step by the midpoint rule; the quaternion keeps the length it comes to.

   @param body    as for fl_body_rates
   @param wrench  (6,) [N, N m]
   @param step    length of the step [s]
   @param state   (13,), becomes that after the step
   @return        1, or 0 where the motion is too fast */
int fl_body_coarse_step(const fl_real *body, const fl_real *wrench, fl_real step, fl_real *state);

/* Moves fins over one step of their lags, without what happens within the beat.

   @param fins     numbers of `count` fins; finlab/core/src/fin_motion.c has their order
   @param command  (count, 3) [rad, Hz, rad]; a fin whose row is NaN stops at once
   @param states   of the fins, in the order of fin_motion.c; become those after the step */
void fl_follow_fins(const fl_real *fins, const fl_real *command, int count, fl_real *states);

/* Moves fins over steps much shorter than a beat.

   @param fins, command, states  as for fl_follow_fins
   @param step   length of a step [s]
   @param steps  how many
   @param moves  (steps, count, 10) become mean amplitude, frequency and zero direction of a step,
                 whether that beats, and angle, phase, speed, acceleration, inertial and driving
                 power at its end [rad, Hz, rad/s, rad/s^2, W] */
void fl_move_fins(const fl_real *fins, const fl_real *command, int count, fl_real step, int steps,
                  fl_real *states, fl_real *moves);

/* Moves numbers of commands over steps by lags of first order with a largest rate.

   @param lags     of `count` numbers; finlab/core/src/first_order_lag.c has their order
   @param command  (count,); NaN for a number whose actuator stops
   @param step     length of a step [s]
   @param steps    how many
   @param values   (steps + 1, count): the first are those at the beginning; the others become
                   those after each step */
void fl_follow_lags(const fl_real *lags, const fl_real *command, int count, fl_real step, int steps,
                    fl_real *values);

/* Says which wrenches move a robot along a path, nose ahead.

   @param axes          linear and quadratic damping, inertia; of surge, sway, heave and yaw (4, 3)
   @param velocity      of the path in the world (count, 3), at least two points [m/s]
   @param acceleration  of the path in the world (count, 3) [m/s^2]
   @param current       horizontal velocity of the water in the world (2,) [m/s]
   @param slow          speed through the water below which turning counts less and less [m/s]
   @param period        time from one point to the next [s]
   @param wrenches      become those at the points (count, 6), body frame [N, N m] */
void fl_path_wrenches(const fl_real *axes, const fl_real *velocity, const fl_real *acceleration,
                      int count, const fl_real *current, fl_real slow, fl_real period,
                      fl_real *wrenches);

/* Predicts the covariance of a filter over a step: P <- F P F^T + Q.

   @param transition  F (size, size)
   @param noise       diagonal of Q (size,)
   @param size        how many states, at most 16
   @param covariance  P (size, size), symmetric */
void fl_kalman_predict(const fl_real *transition, const fl_real *noise, int size,
                       fl_real *covariance);

/* Corrects a filter by measurements of the states `first` to `last - 1`, whose noise is
   independent.

   @param variance    of the noise, by state
   @param innovation  what was measured less the states, by state
   @param size        how many states, at most 16
   @param state       (size,)
   @param covariance  P (size, size), symmetric */
void fl_kalman_correct(const fl_real *variance, const fl_real *innovation, int first, int last,
                       int size, fl_real *state, fl_real *covariance);

/* Carries the state of the fault monitor's model on over a period, and says its derivatives.

   @param body        numbers of the body; finlab/core/src/motion_model.c has their order, and that
                      of a state of d = 49 + 4 strengths + held numbers
   @param wrenches    of each actuator at full strength, then of each unit of what stuck ones give
                      (strengths + held, 6), body frame [N, N m]
   @param owners      actuator of each of these (strengths + held,)
   @param strengths   how many actuators
   @param held        how many numbers say what stuck ones give
   @param yaw         heading [rad]
   @param dt          length of the period [s]
   @param covariance  of the state (d, d); 0 where none is known
   @param state       (d,) becomes that at the end
   @param transition  becomes the derivatives of its first 9 numbers by the state before (9, d)
   @param rates       become the rates of change of these numbers at the beginning (9,)
   @param slope       becomes their derivatives by the state (9, d)
   @param terms       become squares of accelerations that the equation's terms come to, and of what
                      is not linear in the errors of the state (2, 6) */
void fl_motion_step(const fl_real *body, const fl_real *wrenches, const int *owners, int strengths,
                    int held, fl_real yaw, fl_real dt, const fl_real *covariance, fl_real *state,
                    fl_real *transition, fl_real *rates, fl_real *slope, fl_real *terms);

/* Carries the covariance of the fault monitor's filter on over a period, and what jumps at several
   moments have made of the state; finlab/core/src/jump_filter.c says what these are.

   @param transition   derivatives of the first 9 numbers of the state by the state before (9, d)
   @param noise        variances that the period adds (d,)
   @param limit        largest variances (d,)
   @param columns      numbers of the state that jump (c,)
   @param most         moments that there is memory for
   @param used         how many of them, the first, may count
   @param d            numbers of the state
   @param active       how many of them, the first, are in doubt
   @param covariance   P (d, d), symmetric
   @param sensitivity  what a jump of 1 of each column at each moment makes of the state
                       (d, most, c) */
void fl_jumps_predict(const fl_real *transition, const fl_real *noise, const fl_real *limit,
                      const int *columns, int most, int used, int d, int active, int c,
                      fl_real *covariance, fl_real *sensitivity);

/* Corrects that filter by at most 12 measured numbers, and weighs the jumps by them. Nothing is
   changed where the model says nothing of the measurement.

   @param rows           derivatives of what is measured by the state (measured, d)
   @param innovation     what was measured less what was expected (measured,)
   @param variance       of the measurement's noise (measured,)
   @param most_distance  squared innovation, in variances, from which on nothing is changed
   @param state          (d,)
   @param information    Lambda of the jumps at each moment (most, c, c)
   @param score          eta of them (most, c)
   @return squared innovation, in variances; -1 where nothing was changed */
fl_real fl_jumps_update(const fl_real *rows, const fl_real *innovation, const fl_real *variance,
                        int measured, fl_real most_distance, const int *columns, int most, int used,
                        int d, int active, int c, fl_real *state, fl_real *covariance,
                        fl_real *sensitivity, fl_real *information, fl_real *score);

/* Says how likely it is that an actuator has come to each of several targets at each moment.

   @param actuators  numbers of n of them; finlab/core/src/jump_evidence.c has their order, and that
                     of `targets`, of which there are `kinds`, and of `spread`
   @param h          numbers that say what stuck ones give
   @param strength   what was believed at each moment (slots, n)
   @param held       the same of what stuck ones give (slots, h)
   @param moved      what each would have given on had it stuck (slots, h)
   @param prior      logarithms of rates (n, kinds); -INFINITY for what cannot be
   @param span       logarithms of the times that the moments stand for (count,)
   @param temper     by what logarithms of likelihoods are divided
   @param log_odds   become logarithms of the odds against none (count, n, kinds)
   @param mean       become those of the jumps' priors where the odds are finite: of the strength,
                     and of what it gives where it sticks (count, n, kinds, 3)
   @param variance   the same of their variances (count, n, kinds, 3) */
void fl_jumps_of_actuators(const fl_real *information, const fl_real *score, const int *slots,
                           int count, int c, const fl_real *actuators, int n, int h,
                           const fl_real *targets, int kinds, const fl_real *spread,
                           const fl_real *strength, const fl_real *held, const fl_real *moved,
                           const fl_real *prior, const fl_real *span, fl_real temper,
                           fl_real *log_odds, fl_real *mean, fl_real *variance);

/* The same of two actuators that are lost at one moment.

   @param works     which actuators may be (n,)
   @param log_odds  (count, n, n), -INFINITY where the first is not before the second */
void fl_jumps_of_pairs(const fl_real *information, const fl_real *score, const int *slots,
                       int count, int c, int n, const fl_real *strength, const int *works,
                       const fl_real *span, fl_real log_rate, fl_real temper, fl_real *log_odds);

/* The same of a wrench that no actuator gives, the last six columns of the jumps.

   @param variance  of the wrench (6,)
   @param log_odds  (count,) */
void fl_jumps_of_wrench(const fl_real *information, const fl_real *score, const int *slots,
                        int count, int c, const fl_real *variance, const fl_real *span,
                        fl_real log_rate, fl_real temper, fl_real *log_odds);

/* Logarithms of sums of exponentials, over all rows and over the columns of each group.

   @param values  (rows, width)
   @param groups  which one of `count` each column belongs to (width,)
   @param tops    become the largest values of each group (count,)
   @param sums    (count,) */
void fl_log_sums(const fl_real *values, int rows, int width, const int *groups, int count,
                 fl_real *tops, fl_real *sums);

/* Features and vectors of the messages between actuators, and between each and the hull.

   @param constants    of the robot; finlab/core/src/messages.c has their order
   @param force        (count, n, 3) of the actuators [N], body frame
   @param count        how many questions
   @param pair_rows    becomes 11 features and 4 vectors of each pair (count, p, 23)
   @param pair_slopes  becomes their derivatives by the forces of source and receiver
                       (count, p, 6, 23); 0 for none
   @param hull_rows    becomes 7 features and 3 vectors of each actuator (count, n, 16), where there
                       is a hull
   @param hull_slopes  becomes their derivatives by its force (count, n, 3, 16); 0 for none */
void fl_message_rows(const fl_real *constants, const fl_real *force, int count, fl_real *pair_rows,
                     fl_real *pair_slopes, fl_real *hull_rows, fl_real *hull_slopes);

/* Adds messages up to a wrench offset, whatever model gave the factors of their vectors.

   @param constants      of the robot, as for fl_message_rows
   @param count          how many questions
   @param pair_messages  of pairs of actuators
   @param hull_messages  of each actuator and the hull; not read without one
   @param offset         becomes the offsets (count, 6) [N, N m]
   @param slope          becomes their derivatives by the forces (count, n, 3, 6); 0 for none */
void fl_message_wrench(const fl_real *constants, int count, const fl_messages *pair_messages,
                       const fl_messages *hull_messages, fl_real *offset, fl_real *slope);

/* @param i      which actuator
   @param force  along its direction; of planes its size, below 0 in reverse [N]
   @return       the least power for it, Eq. 2 [W] */
fl_real fl_power_of_force(const fl_real *block, int i, fl_real force);

#ifdef __cplusplus
}
#endif
#include "fl_work.h"
#endif
