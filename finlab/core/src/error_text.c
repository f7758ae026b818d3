/* What an error code means, in a sentence for who has to act on it. */
#include "internal.h"

static const char *const TEXT[] = {
    "all is well",
    "the block is no robot of this library, or was cut or changed; export the robot again",
    "the block was made for another version of this library; export the robot again",
    "a number of the robot is out of the range that the library works with; check its forces, "
    "powers and sizes",
    "a number of the question is not finite or out of range; name an axis that may take any wrench "
    "in free",
#if FL_KEEPS_BUDGETS
    "the commands take more power than a bus may give: rates forbid less in this tick, or none was "
    "found; ask for a smaller wrench",
#endif
};

const char *fl_error_text(int code) {
  const int codes = sizeof TEXT / sizeof *TEXT;
  if (code < 0 || code >= codes) return "no error code of this library";
  return TEXT[code];
}
