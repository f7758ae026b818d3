"""A robot that learns its actuators while it swims.

Every minute the last four are fitted, and what strengths and directions of the actuators turn out
to be is what allocation works with from then on. It is the `Learner` of a `ClosedLoop`.
"""

from collections import deque
from dataclasses import replace

import numpy as np

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.swim.identification.fitted_robot import fitted_actuators
from finlab.swim.identification.robot_fit import EXPLAINED_MIN, fit_robot
from finlab.swim.identification.swim import STEP_S, Swim, followed, only_new
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.fin_motion import FinMotion

FIT_PERIOD_S = 60.0
"""Time between fits [s]."""
FIT_SPAN_S = 240.0
"""How much of the swim, up to now, each fit takes [s]."""
DOUBTS = {"inertia": 0.3, "linear": 0.3, "quadratic": 0.3, "mounting": 0.5, "center": 0.5}
"""How doubtful body and places of the actuators are, as a share of that before a swim that shakes a
robot: a path tells less of them, and what they take up is missing in the strengths."""


class OnlineFit:
    """What a robot's actuators are, by its own swim; to be called every `STEP_S` seconds."""

    def __init__(self, layout: Layout) -> None:
        """Takes the robot as it is believed to be. Raises FinlabError: a fin is a table, whose
        strength is no number of the layout."""
        for fin in layout.fins:
            if fin.model.type == "table":
                why = "expected a law: the strength of a table is fixed"
                raise FinlabError(f"fin {fin.name} is a table, {why}")
        self.layout = layout
        """As it was believed to be before."""
        self.notes: list[str] = []
        """What each fit has found, a sentence each."""
        self.factor = np.ones((layout.n, 3))
        """By what commands to the robot as it was learned are multiplied for its drives (n, 3)."""
        self._moving = ActuatorMotion(layout, FinMotion(layout))
        self._recent: deque[tuple[Array, Array]] = deque(maxlen=round(FIT_SPAN_S / STEP_S))
        self._steps = 0

    def step(self, measured: Array, command: Array) -> Layout | None:
        """Takes what happened in one step, and fits the last minutes once a minute.

        Args:
            measured: what the sensors said last (12,), in the order of `CHANNELS`.
            command: the drives' command for this step (n, 3), NaN for those at rest.

        Returns:
            The robot as the last minutes show it, in the step in which they were fitted; else None.
        """
        self._recent.append((followed(self._moving, command), measured))
        self._steps += 1
        if self._steps % round(FIT_PERIOD_S / STEP_S):
            return None
        motion = np.array([moved for moved, _ in self._recent])
        measurements = np.array([seen for _, seen in self._recent])
        swim = Swim("the swim", motion, only_new(measurements))
        fit = fit_robot(self.layout, [swim], other_law=False, doubts=DOUBTS)
        if fit.explained < EXPLAINED_MIN:
            self.notes.append(
                f"{self._steps * STEP_S:.0f} s: nothing is learned, since simulated swims explain "
                f"{fit.explained:.0%} of the motion, expected at least {EXPLAINED_MIN:.0%}"
            )
            return None
        strength = np.exp(fit.estimate("strength"))
        error = fit.standard_error("strength")
        rows = zip(self.layout.names, strength, error, strict=True)
        words = ", ".join(f"{name} {own:.2f} +- {own * unsure:.2f}" for name, own, unsure in rows)
        turned = "".join(f"; {name} pushes the other way" for name in fit.opposed)
        self.notes.append(f"{self._steps * STEP_S:.0f} s: learned strengths {words}{turned}")
        for i, part in enumerate(self.layout.actuators):
            if (
                part.KIND.force_number is not None
            ):  # so that it gives the force that it is asked for
                self.factor[i, part.KIND.force_number] = 1.0 / strength[i]
        return replace(self.layout, actuators=fitted_actuators(fit, fit.estimate("lean")))
