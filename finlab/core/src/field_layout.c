/* What the fields of a block promise, checked by the compiler. */
#include "finlab.h"

#define FL_ASSERT(name, condition) typedef char fl_assert_##name[(condition) ? 1 : -1]

/* A struct has the size of its fields: no padding, so each lies where those before it end, and a
   block is read in place. */
/* clang-format off */
#define FL_BEGIN(type) enum { type##_bytes = 0
#define FL_FIELD(type, name, shape, unit, meaning) + (int)sizeof(type shape)
#define FL_END(type) };
/* clang-format on */
#include "fl_fields.h"
#undef FL_BEGIN
#undef FL_FIELD
#undef FL_END
FL_ASSERT(no_padding_in_head, sizeof(fl_head) == fl_head_bytes);
FL_ASSERT(no_padding_in_actuator, sizeof(fl_actuator) == fl_actuator_bytes);
FL_ASSERT(no_padding_in_head_for_actuators, sizeof(fl_head) % sizeof(fl_real) == 0);
FL_ASSERT(whole_number_of_four_bytes, sizeof(int) == 4);
