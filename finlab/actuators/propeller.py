"""The propeller that thrusters with a fixed axis and turning ones share: its limits, its power, its
jet, and its input for a force."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from finlab.actuators.actuator import Actuator, Command
from finlab.actuators.law import ActuatorLaw, Formula, PowerFormula
from finlab.actuators.response import Form
from finlab.actuators.thrust_model import MAX_FORCE, PowerLaw, PowerTable, ThrustModel
from finlab.actuators.thrust_power import ThrustPower
from finlab.arrays import NEARLY, NOTHING, AnyArray, Array, Values
from finlab.display import prefix_of
from finlab.errors import AllocationError

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

ForceRate = Annotated[float, Meta(ge=1e-6, le=1e9)]
"""A rate of change of a force [N/s]."""
Threshold = Annotated[float, Meta(ge=0.0, le=MAX_FORCE)]
"""A size of a force [N]."""
OpenWater = tuple[
    Annotated[float, Meta(ge=1e-3, le=10.0)], Annotated[float, Meta(ge=1e-2, le=10.0)]
]
"""Thrust coefficient Kt at rest, and the advance ratio J at which there is no thrust [1]."""
T200 = PowerLaw(forward=0.997, reverse=1.449)
"""Power [W] of a T200 of Blue Robotics at 16 V, over the force [N]."""
T200_FORCE = 51.44
"""Its largest force ahead [N]."""
T200_FORCE_ASTERN = -39.91
"""Its largest force astern [N]."""
T200_DIAMETER = 0.076
"""Diameter of its propeller [m]."""
LEAST_DIAMETER = 1e-3
"""The smallest diameter that a propeller may have [m]."""
LEAST_FORCE = 1e-9
"""Force [N] at least, by which the power of a table's end is divided."""
LEAST_FACTOR = 1e-6
"""Power at 1 N [W] that a law made of a table has at least."""
FORMULAS = ("power_law",)
"""Types of `ThrustModel` that need no measurements."""
LAW_FIELDS = tuple(field.name for field in fields(PowerLaw))
"""Parameters of a `PowerLaw`."""


class Propeller(Actuator):
    """Base of thrusters, fixed or turning; `Thruster` says what its fields mean."""

    KEYS: ClassVar[Mapping[str, str]] = {
        "position": "position_m",
        "force": "force_n",
        "dead_band": "dead_band_n",
        "torque_per_newton": "torque_per_newton_m",
        "time_constant": "time_constant_s",
        "rate": "rate_n_s",
        "diameter": "diameter_m",
    }
    UNSAID: ClassVar[tuple[str, ...]] = ("hangs",)

    force: tuple[float, float]
    model: ThrustModel
    dead_band: float
    rate: float | None
    diameter: float | None
    open_water: tuple[float, float] | None
    hangs: bool

    def hung(self, force: float) -> "Self":
        """Returns it with a single force, which it keeps whatever is commanded.

        The propeller is the same: a jet that was estimated from the largest force stays as it is.

        Args:
            force: the force that it keeps [N].

        Raises:
            AllocationError: it cannot give that force, which is not clipped, since the others
                would then compensate for a force that is not there.
        """
        least, most = self.force
        rounding = NEARLY * max(-least, most)
        if not least - rounding <= force <= most + rounding:
            raise AllocationError(
                f"damage of {self.name!r}: expected a force from {least:g} to {most:g} N, which "
                f"is what this {self.type} can give, got {force:g} N"
            )
        held = min(max(force, least), most)
        diameter = self.diameter or max(self.jet, LEAST_DIAMETER)
        return replace(self, force=(held, held), diameter=diameter, hangs=True)

    @property
    def jet(self) -> float:
        """See `Actuator`: the diameter of its propeller, or that at which its largest force per
        area of the disc is a T200's."""
        if self.diameter:
            return self.diameter
        largest = max(map(abs, self.force))
        return T200_DIAMETER * math.sqrt(largest / T200_FORCE)

    @property
    def advance(self) -> float | None:
        """See `Actuator`. Along the line `Kt = Kt0 (1 - J / J0)`, `J = V / (n D)` (Fossen, 2011,
        section 9.4), the loss is `J / J0`, and the jet's speed at rest is `n D sqrt(8 Kt0 / pi)`.
        """
        if self.open_water is None:
            return None
        Kt0, J0 = self.open_water
        return math.sqrt(8.0 * Kt0 / math.pi) / J0

    def with_value(self, key: str, value: Any) -> "Self":
        if key not in LAW_FIELDS:
            return super().with_value(key, value)
        if not isinstance(self.model, PowerLaw):
            return self
        return replace(self, model=replace(self.model, **{key: value}))

    def with_model(self, model_type: str) -> "Self":
        if not isinstance(self.model, PowerTable):
            return self
        return replace(self, model=_law_of(self.model))

    def scaled(self, share: float) -> "Self":
        """See `Actuator`. The command is the force itself: of 0.8 of the force the limits are 0.8
        as large, and a force takes the power that force / 0.8 took."""
        return replace(
            self,
            force=(share * self.force[0], share * self.force[1]),
            dead_band=share * self.dead_band,
            rate=None if self.rate is None else share * self.rate,
            model=scaled_model(self.model, share),
        )

    def command(self, row: Array) -> Command | None:
        """See `Actuator`: with the input for its force, where it has a table."""
        numbers = row.tolist()[: len(self.KIND.numbers)]
        if math.isnan(numbers[0]):
            return None
        table_input = input_of(self.model, numbers[-1])
        return self.KIND.command(*numbers, None if table_input is None else float(table_input))

    def commands(self, rows: Array) -> Command:
        """See `Actuator`: with the inputs for their forces, where it has a table."""
        numbers = rows[:, : len(self.KIND.numbers)].T
        table_input = input_of(self.model, numbers[-1])
        if table_input is not None:
            table_input.setflags(write=False)
        return self.KIND.command(*numbers, table_input)


def input_of(model: ThrustModel, force: ArrayLike) -> Array | None:
    """Returns the inputs of a propeller for forces, by its table.

    Args:
        model: power law or table.
        force: forces (...) [N].

    Returns:
        Inputs (...) in the table's unit, interpolated linearly, for a force of 0 the middle of the
        inputs that give none; None for a power law.
    """
    if not isinstance(model, PowerTable):
        return None
    force = np.asarray(force, np.float64)
    inputs, forces, _ = model.columns
    first_zero = np.searchsorted(forces, 0.0, "left")
    past_zero = np.searchsorted(forces, 0.0, "right")
    ahead = slice(max(past_zero - 1, 0), None)
    astern = slice(0, first_zero + 1)
    result: Array = np.where(
        force > 0.0,
        np.interp(force, forces[ahead], inputs[ahead]),
        np.interp(force, forces[astern], inputs[astern]),
    )
    if first_zero < past_zero:
        middle = 0.5 * (inputs[first_zero] + inputs[past_zero - 1])
        result = np.where(force == 0.0, middle, result)
    return result


def usable_force(propeller: Any) -> tuple[float, float]:
    """Returns the least and most force [N] of a propeller, its `force`; (0, 0) where all of it lies
    within the `dead_band`."""
    least, most = propeller.force
    largest = max(-least, most)
    if largest >= propeller.dead_band * (1.0 - NOTHING):
        return least, most
    return 0.0, 0.0


def form_of(
    kind: Literal["thruster", "pod"],
    limits: Array,
    sign: float = 1.0,
    *,
    turning_costs: bool = False,
) -> Form:
    """Returns how forces of a propeller become commands.

    Args:
        kind: whether its axis is fixed.
        limits: its usable force, least and most (2,) [N]; zeros for one that gives none.
        sign: sign of a thruster's command for a force along its `Line`.
        turning_costs: whether a change of the command's angle has a cost in a tick.
    """
    gives_nothing = not limits.any()
    return Form(
        kind,
        axes=np.zeros((3, 3)) if gives_nothing else None,
        turning_costs=turning_costs,
        command_sign=sign,
    )


def _law_of(table: PowerTable) -> PowerLaw:
    """A power law, exponent 1.5, through both ends of a table."""
    _, force, power = table.columns
    forward = _factor(force[-1], power[-1])
    reverse = _factor(force[0], power[0])
    return PowerLaw(forward or reverse or 1.0, reverse)


def _factor(force: float, power: float) -> float | None:
    """Power at 1 N [W], to four digits, where P ~ F^1.5 passes through a point (N, W); None at a
    force of 0."""
    if not force:
        return None
    factor = power / max(abs(force), LEAST_FORCE) ** 1.5
    return float(f"{max(factor, LEAST_FACTOR):.4g}")


def scaled_model(model: ThrustModel, share: float) -> ThrustModel:
    """Returns the model of a propeller with `share` of the force at each power."""
    if isinstance(model, PowerTable):
        rows = tuple((command, share * force, power) for command, force, power in model.rows)
        return replace(model, rows=rows)
    # P = c (F / share)^e
    factor = share**-model.exponent
    reverse = None if model.reverse is None else factor * model.reverse
    return PowerLaw(factor * model.forward, reverse, model.exponent)


def force_words(force: float, angle: str, table_input: float | None) -> str:
    """Returns a command as text: force [N], angle in words, and input where there is one."""
    prefix = prefix_of(abs(force))
    words = f"{round(force / prefix.factor, 3) + 0.0:.3f} {prefix.symbol}N{angle}"
    return words if table_input is None else f"{words}, input {table_input:.5g}"


class PropellerLaw(ActuatorLaw):
    """Base of the laws of n propellers: one number of the command is the force, which is 0 within
    the dead band."""

    column: int
    """Index of that number in a command (3,)."""
    formula_kind: str
    """Name of the law in the core, where its power is one, too."""

    def __init__(self, propellers: Sequence[Propeller]) -> None:
        """Takes n thrusters, or n that turn."""
        self.power_curve = ThrustPower([propeller.model for propeller in propellers])
        self.dead_band = np.array([propeller.dead_band for propeller in propellers])

    def thrust(self, command: Values) -> Any:
        """Returns the signed forces (..., n) [N] of commands (..., n, 3)."""
        return outside_dead_band(command[..., self.column], self.dead_band)

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`: electrical power, with the motor's loss; turning takes none."""
        return self.power_curve.watts(self.thrust(command))

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        gradient = np.zeros(command.shape)
        gradient[..., self.column] = self.power_curve.marginal(self.thrust(command))
        return gradient

    def formula(self) -> Formula | None:
        laws = self.power_curve.power_laws
        if laws is None:
            return None
        numbers = {
            "coefficient": laws.forward,
            "coefficient_reverse": laws.reverse,
            "power_exponent": laws.exponent,
            "dead_band": self.dead_band,
        }
        return Formula(self.formula_kind, numbers)

    def power_formula(self) -> PowerFormula | None:
        formula = self.formula()
        if formula is not None:
            return PowerFormula(formula, None)
        measured = self.power_curve.measured()
        if measured is None:
            return None
        laws, curves = measured
        numbers = {
            "coefficient": laws.forward,
            "coefficient_reverse": laws.reverse,
            "power_exponent": laws.exponent,
            "dead_band": self.dead_band,
        }
        return PowerFormula(Formula(self.formula_kind, numbers), curves)


def power_law_margins(propellers: Sequence[Propeller]) -> list[Array | None]:
    """Returns the power laws of propellers as `Group.conjugate_margins` has them.

    Args:
        propellers: m thrusters, or m that turn.

    Returns:
        Of each -1, power at 1 N ahead and in reverse [W], and exponent [1]; None of one with a
        table, and of one with a dead band, in which a tick may leave it.
    """
    margins: list[Array | None] = []
    for propeller in propellers:
        model = propeller.model
        margin: Array | None = None
        if isinstance(model, PowerLaw) and propeller.dead_band == 0.0:
            reverse = model.forward if model.reverse is None else model.reverse
            margin = np.array([-1.0, model.forward, reverse, model.exponent])
        margins.append(margin)
    return margins


def outside_dead_band(force: AnyArray, dead_band: Array, inside: Array | float = 0.0) -> AnyArray:
    """Returns the forces that propellers give for commanded ones.

    Args:
        force: commanded forces (..., n) [N].
        dead_band: dead bands (n,) [N].
        inside: forces within the dead band [N].
    """
    is_inside = np.abs(force) < dead_band * (1.0 - NOTHING)
    return np.asarray(np.where(is_inside, inside, force))
