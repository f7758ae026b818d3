"""A robot that learns its actuators while it swims: every minute the last four are fitted, and what their
strengths and directions turn out to be is what allocation works with from then on."""

from collections import deque
from dataclasses import replace

import numpy as np

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.fit.robot.fitted_robot import asked_more, learned
from finlab.fit.robot.robot_fit import SOUND, fit_robot
from finlab.fit.robot.swim import STEP_S, Swim, followed, only_new
from finlab.layout import Layout
from finlab.vehicle.actuator_motion import ActuatorMotion
from finlab.vehicle.fin_motion import FinMotion

EVERY_S, LAST_S = 60.0, 240.0
"""Time between fits [s], and how much of the swim each takes."""
DOUBTS = {"inertia": 0.3, "linear": 0.3, "quadratic": 0.3, "mounting": 0.5, "center": 0.5}
"""How doubtful body and places of the actuators are, as a share of that before a swim that shakes a robot:
a path tells less of them, and what they take up is missing in the strengths."""


class OnlineFit:
    """What a robot's actuators are, by its own swim; to be called every `STEP_S` seconds."""

    def __init__(self, layout: Layout) -> None:
        """Takes the robot as it is believed to be. Raises FinlabError: a fin is a table, whose strength is no
        number of the layout."""
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
        self._last: deque[tuple[Array, Array]] = deque(maxlen=round(LAST_S / STEP_S))
        self._steps = 0

    def step(self, measured: Array, command: Array) -> Layout | None:
        """Returns the robot as the last minutes show it, whenever they have been fitted, by what the sensors
        said last (12,), in the order of `CHANNELS`, and the drives' command for this step (n, 3), NaN for
        those at rest."""
        self._last.append((followed(self._moving, command), measured))
        self._steps += 1
        if self._steps % round(EVERY_S / STEP_S):
            return None
        motion, said = (np.array(part) for part in zip(*self._last, strict=True))
        swim = Swim("the swim", motion, only_new(said))
        fit = fit_robot(self.layout, [swim], other_law=False, doubts=DOUBTS)
        if fit.explained < SOUND:
            self.notes.append(
                f"{self._steps * STEP_S:.0f} s: nothing is learned, since simulated swims explain "
                f"{fit.explained:.0%} of the motion, expected at least {SOUND:.0%}"
            )
            return None
        strength, error = np.exp(fit.found("strength")), fit.found_error("strength")
        rows = zip(self.layout.names, strength, error, strict=True)
        words = ", ".join(f"{name} {own:.2f} +- {own * unsure:.2f}" for name, own, unsure in rows)
        turned = "".join(f"; {name} pushes the other way" for name in fit.opposed)
        self.notes.append(f"{self._steps * STEP_S:.0f} s: learned strengths {words}{turned}")
        self.factor = asked_more(self.layout, strength)
        return replace(self.layout, actuators=learned(fit, fit.found("lean")))
