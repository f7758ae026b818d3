"""The result of a search for a better layout in words; `finlab layout optimize` prints them, and
the app's panel (`webapp/panels/limits_tab.py`) shows them."""

from collections.abc import Mapping

from finlab.allocation.power_budget import budget_of
from finlab.analysis.authority import AXES
from finlab.analysis.card_text import Remark
from finlab.analysis.goals import MISSION, UNREACHED, GoalName
from finlab.analysis.optimize import Improvement
from finlab.display import Table, as_sentence, listed, table_of, with_unit
from finlab.layout.layout_text import COLUMNS

GOAL_WORDS: Mapping[str, str] = {
    "weakest_direction": "weakest direction",
    "mission_power": "power for a mission",
    "worst_single_failure": "worst single failure",
}
"""Name of each goal -> its words."""
POWER_GOAL: GoalName = "mission_power"
"""The goal whose values are powers, with a minus sign, so that more is better."""
MOVED_COLUMNS = tuple(
    column for column in COLUMNS if column.name in ("actuator", "x", "y", "z", "direction")
)
"""Those columns of the table of actuators that a search changes."""


def goal_value(goal: str, value: float) -> str:
    """Returns the value of a goal with its unit: `7.10 N`, `2.32 W`.

    Args:
        goal: its name.
        value: as the search has it; powers are negative.
    """
    return with_unit(abs(value), "W" if goal == POWER_GOAL else "N")


def improvement_remarks(improvement: Improvement) -> list[Remark]:
    """Returns sentences on the goal before and after, and on what to know of these values."""
    goal = improvement.goal
    if not improvement.improved:
        return [Remark("Nothing better was found within reach."), *_bound_remarks(improvement)]
    axes = ""
    if goal != POWER_GOAL and len(improvement.axes) < len(AXES):
        axes = f" of {listed(improvement.axes)}, with anything on the others"
    before = goal_value(goal, improvement.value_before)
    after = goal_value(goal, improvement.value_after)
    remarks = [Remark(as_sentence(f"{GOAL_WORDS[goal]}{axes}: {before} before, {after} after"))]
    if goal != POWER_GOAL and budget_of(improvement.layout) is not None:
        remarks.append(
            Remark("The search leaves the power budget out; the score cards are within it.")
        )
    remarks += _bound_remarks(improvement)
    if improvement.cancelled:
        remarks.append(Remark("The search was stopped early."))
    # The goal is minus the mean over the mission, and one wrench alone may count with UNREACHED.
    if goal == POWER_GOAL and -improvement.value_before * len(MISSION) >= UNREACHED:
        remarks.append(Remark(f"A wrench out of reach counts with {UNREACHED:g} W or more."))
    pushed_after = improvement.card_after.authority.alone
    lost = [axis for axis in improvement.card_before.authority.alone if axis not in pushed_after]
    if lost:
        remarks.append(Remark(f"It no longer pushes {listed(lost)} alone.", is_warning=True))
    return remarks


def _bound_remarks(improvement: Improvement) -> list[Remark]:
    """A sentence on what no layout exceeds, where that is known."""
    if improvement.bound is None:
        return []
    value = goal_value(improvement.goal, improvement.bound.value)
    words = f"no layout of these thrusters within these bounds has more than {value}"
    if improvement.below is not None:
        words = f"at most {100.0 * improvement.below:.1f} % below the best possible: {words}"
    return [Remark(as_sentence(words))]


def moved_table(improvement: Improvement) -> Table:
    """Returns where the actuators that could move are, and their directions."""
    return table_of(
        MOVED_COLUMNS, [improvement.layout.actuator(name) for name in improvement.moved]
    )
