"""The propeller of thrusters, fixed or turning: its description, its law, and its input for a
force."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from finlab.actuators.actuator import Actuator, Box, Command
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import Form
from finlab.actuators.thrust_model import MAX_FORCE, PowerLaw, PowerTable, ThrustModel
from finlab.actuators.thrust_power import ThrustPower
from finlab.arrays import NEARLY, NOTHING, AnyArray, Array, Values
from finlab.errors import AllocationError

ForceRate = Annotated[float, Meta(ge=1e-6, le=1e9)]
Threshold = Annotated[float, Meta(ge=0.0, le=MAX_FORCE)]
T200 = PowerLaw(0.997, 1.449)
"""Power of a T200 of Blue Robotics at 16 V."""
T200_FORCE, T200_DIAMETER = 51.44, 0.076
"""Its largest force [N], and the diameter of its propeller [m]."""
LEAST_DIAMETER = 1e-3
"""The smallest diameter that a propeller may have [m]."""
OpenWater = tuple[
    Annotated[float, Meta(ge=1e-3, le=10.0)], Annotated[float, Meta(ge=1e-2, le=10.0)]
]
LAW_KEYS = tuple(field.name for field in fields(PowerLaw))


class Propeller(Actuator):
    """Base of thrusters, fixed or turning: limits of the force [N], dead band, power, jet; see
    `Actuator`."""

    KEYS: ClassVar[Mapping[str, str]] = {
        "position": "position_m",
        "force": "force_n",
        "dead_band": "dead_band_n",
        "torque_per_newton": "torque_per_newton_m",
        "time_constant": "time_constant_s",
        "rate": "rate_n_s",
        "diameter": "diameter_m",
    }
    BOXES: ClassVar[tuple[Box, ...]] = (
        Box("Dead band [N]", "dead_band", "Forces smaller than this, but 0, cannot be held."),
        Box("Rate [N/s]", "rate", "How fast the force changes; 0: at once.", free=True),
        Box("Lag [s]", "time_constant", "Time to 63 % of a new command.", 0.05),
        Box(
            "Diameter [m]",
            "diameter",
            "Of the propeller, for its jet; 0: by its force.",
            0.01,
            free=True,
        ),
        Box("Torque/force [m]", "torque_per_newton", "Reaction torque, signed.", 0.001),
    )
    LAW_BOXES = (
        Box(
            "Ahead [W]",
            "forward",
            "Power at 1 N; F newtons take it times F^exponent.",
            law="power_law",
        ),
        Box(
            "Astern [W]",
            "reverse",
            "The same of a negative force; 0: as ahead.",
            free=True,
            law="power_law",
        ),
        Box("Exponent", "exponent", "1.5 is that of an ideal propeller at rest.", law="power_law"),
    )

    MODELS = ("power_law",)
    UNSAID: ClassVar[tuple[str, ...]] = ("hangs",)

    force: tuple[float, float]
    model: ThrustModel
    dead_band: float
    rate: float | None
    diameter: float | None
    open_water: tuple[float, float] | None
    hangs: bool

    def hung(self, force: float) -> Self:
        """Returns it with a force [N] as its only one, at which it hangs whatever is asked.

        The propeller is the same: a jet that was guessed from the largest force stays as it is.
        Raises AllocationError: it cannot give that force, which is not clipped, since then the
        others would make up for a force that is not there.
        """
        least, most = self.force
        rounding = NEARLY * max(-least, most)
        if not least - rounding <= force <= most + rounding:
            raise AllocationError(
                f"damage of {self.name!r}: expected a force from {least:g} to {most:g} N, which "
                "is what this "
                f"{self.type} can give, got {force:g} N"
            )
        held = min(max(force, least), most)
        diameter = self.diameter or max(self.jet, LEAST_DIAMETER)
        return replace(self, force=(held, held), diameter=diameter, hangs=True)

    @property
    def jet(self) -> float:
        """See `Actuator`: its diameter, or that at which its largest force loads the disc as a
        T200's."""
        return self.diameter or T200_DIAMETER * math.sqrt(max(map(abs, self.force)) / T200_FORCE)

    @property
    def advance(self) -> float | None:
        """See `Actuator`. Along the line `Kt = Kt0 (1 - J / J0)`, `J = V / (n D)` (Fossen, 2011,
        section
        9.4), the loss is `J / J0`, and the jet's speed at rest is `n D sqrt(8 Kt0 / pi)`."""
        if self.open_water is None:
            return None
        at_rest, none_at = self.open_water
        return math.sqrt(8.0 * at_rest / math.pi) / none_at

    def with_value(self, key: str, value: Any) -> Self:
        if key not in LAW_KEYS:
            return super().with_value(key, value)
        known = isinstance(self.model, PowerLaw)
        return replace(self, model=replace(self.model, **{key: value})) if known else self

    def with_model(self, kind: str) -> Self:
        return (
            replace(self, model=_law_of(self.model)) if isinstance(self.model, PowerTable) else self
        )

    def scaled(self, share: float) -> Self:
        """See `Actuator`. The command is the force that it gives: one of 0.8 has limits of 0.8 as
        much, and takes the power of force / 0.8."""
        return replace(
            self,
            force=(share * self.force[0], share * self.force[1]),
            dead_band=share * self.dead_band,
            rate=None if self.rate is None else share * self.rate,
            model=_scaled(self.model, share),
        )

    def command(self, row: Array) -> Command | None:
        """See `Actuator`: with what its table says to send for it."""
        if np.isnan(row[0]):
            return None
        numbers = row[: len(self.NUMBERS)].tolist()
        sent = input_of(self.model, row[len(self.NUMBERS) - 1])
        return self.COMMAND(*numbers, None if sent is None else float(sent))

    def commands(self, rows: Array) -> Command:
        """See `Actuator`: with what its table says to send for each."""
        numbers = rows[:, : len(self.NUMBERS)].T
        sent = input_of(self.model, numbers[-1])
        if sent is not None:
            sent.setflags(write=False)
        return self.COMMAND(*numbers, sent)


def input_of(model: ThrustModel, force: ArrayLike) -> Array | None:
    """Returns what a table says to send for forces (...) [N], in the table's unit; None for a power
    law.

    Where several inputs give no force, the middle of them stops the propeller.
    """
    if not isinstance(model, PowerTable):
        return None
    force = np.asarray(force, np.float64)
    inputs, forces, _ = model.columns
    first = np.searchsorted(forces, 0.0, "left")
    last = np.searchsorted(forces, 0.0, "right")
    ahead = slice(max(last - 1, 0), None)
    astern = slice(0, first + 1)
    sent: Array = np.where(
        force > 0.0,
        np.interp(force, forces[ahead], inputs[ahead]),
        np.interp(force, forces[astern], inputs[astern]),
    )
    if first < last:
        sent = np.where(force == 0.0, 0.5 * (inputs[first] + inputs[last - 1]), sent)
    return sent


def given_force(part: Any) -> tuple[float, float]:
    """Returns the least and the most force [N] that one gives of `force` with its `dead_band`: none
    where all of its commands lie in the band."""
    least, most = part.force
    largest = max(-least, most)
    return (least, most) if largest >= part.dead_band * (1.0 - NOTHING) else (0.0, 0.0)


def form_of(kind: Literal["thruster", "pod"], given: Array, sign: float = 1.0) -> Form:
    """Returns how the forces of one become commands, by the least and most force (2,) that it gives
    [N] and the sign of a thruster's command: the law of one whose commands all lie in its dead band
    gives nothing."""
    gives_nothing = not given.any()
    return Form(kind, axes=np.zeros((3, 3)) if gives_nothing else None, sign=sign)


def _law_of(table: PowerTable) -> PowerLaw:
    _, force, power = table.columns
    least, most = (
        float(f"{max(power[k] / max(abs(force[k]), 1e-9) ** 1.5, 1e-6):.4g}") if force[k] else None
        for k in (0, -1)
    )
    return PowerLaw(most or least or 1.0, least)


def _scaled(model: ThrustModel, share: float) -> ThrustModel:
    if isinstance(model, PowerTable):
        return replace(
            model, rows=tuple((sent, share * force, watts) for sent, force, watts in model.rows)
        )
    more = share**-model.exponent
    reverse = None if model.reverse is None else more * model.reverse
    return PowerLaw(more * model.forward, reverse, model.exponent)


def force_words(force: float, angle: str, sent: float | None) -> str:
    """Returns a force [N] in words, with what is to be sent for it."""
    return f"{round(force, 3) + 0.0:.3f} N{angle}" + ("" if sent is None else f", input {sent:.5g}")


class PropellerLaw(ActuatorLaw):
    """n propellers, one of whose commands is a force; there is none within the dead band."""

    column: int
    """Which of the three commands it is."""

    def __init__(self, parts: Sequence[Propeller]) -> None:
        """Takes n thrusters, or n that turn."""
        self.power_curve = ThrustPower([part.model for part in parts])
        self.dead_band = np.array([part.dead_band for part in parts])

    def given(self, command: Values) -> Any:
        """Returns the forces (..., n) [N] of commands (..., n, 3)."""
        return held(command[..., self.column], self.dead_band)

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`. Models have electrical power, with the motor's loss; turning takes
        none."""
        return self.power_curve.watts(self.given(command))

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        gradient = np.zeros(command.shape)
        gradient[..., self.column] = self.power_curve.marginal(self.given(command))
        return gradient


def held(force: AnyArray, dead_band: Array, rest: Array | float = 0.0) -> AnyArray:
    """Returns the forces (..., n) [N] that come of commanded ones: `rest` within the dead bands
    (n,) [N]."""
    return np.asarray(np.where(np.abs(force) < dead_band * (1.0 - 1e-9), rest, force))
