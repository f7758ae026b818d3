/* What an error code means, in a sentence for who has to act on it. */
#include "internal.h"

static const char *const TEXT[FL_ERRORS] = {
    "all is well",
    "the block is no robot of this library, or was cut or changed; export the robot again",
    "the block was made for another version of this library; export the robot again",
    "a number of the robot is out of the range that the library works with; check its forces, "
    "powers and sizes",
    "a number of the question is not finite or out of range; name an axis that may take any wrench "
    "in free",
};

const char *fl_error_text(int code) {
  if (code < 0 || code >= FL_ERRORS) return "no error code of this library";
  return TEXT[code];
}
