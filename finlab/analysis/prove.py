"""Proves or refutes that a robot can give any wrench of a box whichever actuators it loses.

The attainable wrenches of convex sets of forces are convex, so a box is attainable where its
corners are. `prove` finds, for each case (who is lost) and corner, forces well inside their sets by
the core's search along rays, and corrects them in rationals until their wrench is the corner
exactly. Where a corner is out of reach, the normal of the plane that bounds the attainable wrenches
is a price that separates it: the counterexample. With a power budget, the dual's answers of least
power and its multipliers take their place. `check_proof` decides whether what was found counts: no
result says more than that it accepted the file.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import combinations, product
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.analysis import check_proof
from finlab.analysis.proof_premises import (
    NotSettledError,
    Part,
    ProofActuator,
    decimals,
    middle_of,
    part_choices,
    proof_actuators,
)
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import CommandError
from finlab.forces.force_sets import SCALE, ForceSets, Shape, assembled, force_sets
from finlab.forces.reach import FINE, axis_ranges
from finlab.layout import Layout

Verdict = Literal["proved", "refuted", "not settled"]
"""What is known of a statement."""
MAX_CASES = 3000
"""Most cases that are looked at: two losses of up to 64 actuators."""
DIGITS = 9
"""Digits of a force in a file, beyond those of its largest force; the last ones of each corner are
fractions."""
RANK_TOLERANCE = 1e-9
"""Share of the strongest wrench below which a direction has no authority [1]."""
WRENCH_TOLERANCE = 1e-9
"""How near to a corner a wrench has to be where the robot has no authority over some direction, so
that rounded axes leave no exact answer [N, N m]."""
NO_REACH = 1e-6
"""Share of the strongest actuator's wrench below which an axis counts as out of reach [1]."""
MAX_SPLITS = 6
"""Most times that a box is split where arcs are wide, one split in the other."""
MAX_CUT_ARCS = 5
"""Most wide arcs that are cut in halves for a counterexample: each doubles the number of prices."""
RIM_POINTS = 97
"""Points on the rim of a sector that the search takes for a polygon."""
SMALL_LEAST = 0.01
"""Least force over the largest one up to which the search takes a sector whole [1]: its forces are
means with an inner point, which lies further ahead."""
BLENDS = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6, 0.0)
"""Shares of the forces well inside that are mixed into those of least power [1]."""


@dataclass(frozen=True)
class ProofResult:
    """Whether a robot can give any wrench of a box whichever actuators it loses."""

    verdict: Verdict
    """`proved`, `refuted` or `not settled`."""
    statement: str
    """What is proved or refuted, in a sentence."""
    reason: str = ""
    """Of what is refuted the counterexample in words, of what is not settled the reason."""
    n_cases: int = 0
    """Number of cases, each with its own lost actuators."""
    n_corners: int = 0
    """Corners of the box in each case."""
    largest_share: float | None = None
    """About the share of the box that holds in all cases, above 1 where there is room [1]; None
    with a power budget, or where something is not settled before."""
    proof: dict[str, Any] | None = field(default=None, repr=False)
    """The file, for JSON; None where nothing is settled."""

    def __str__(self) -> str:
        lines = [f"{self.verdict}: {self.statement}"]
        if self.reason:
            lines.append(self.reason)
        if self.verdict == "proved":
            lines.append(f"{self.n_cases} cases of {self.n_corners} corners, each in fractions.")
        if self.largest_share is not None:
            lines.append(f"About {self.largest_share:.3g} of this box holds, by floats.")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Returns plain values for JSON, without the proof."""
        return {
            "verdict": self.verdict,
            "statement": self.statement,
            "reason": self.reason,
            "cases": self.n_cases,
            "corners": self.n_corners,
            "largest_share": self.largest_share,
        }


def box_share(layout: Layout, share: float, free: Sequence[str] = ()) -> tuple[float, ...]:
    """Returns the half widths (6,) of a box [N, N m]: a share of what each axis can alone, the
    others at zero and everything working, in the weaker one of its two directions.

    Args:
        layout: the robot.
        share: of the reach of each axis [1].
        free: axes that may take any wrench.

    Raises:
        CommandError: all axes are free, or the robot can push along none alone.
    """
    counted = [axis for axis in layout.axes if axis not in free]
    if not counted:
        raise CommandError("free: names each axis that the robot commands")
    layout = replace(layout, axes=tuple(counted))
    # A share of what the forces can: the statement may have a power of its own.
    ranges = axis_ranges(layout, np.zeros(6), power=math.inf)
    reach = np.nan_to_num(np.minimum(-ranges.low, ranges.high), nan=0.0, posinf=0.0, neginf=0.0)
    reach = np.where(layout.commanded, np.maximum(reach, 0.0), 0.0)
    strongest = float(force_sets(layout).unit[0])
    is_nothing = reach / SCALE < NO_REACH * strongest
    if is_nothing.all():
        raise CommandError(
            f"box-share: {layout.name} can push along no axis alone; give half widths of the box"
        )
    half_widths = np.where(is_nothing, 0.0, share * reach)
    return tuple(float(f"{half:.6g}") for half in half_widths)


def prove(
    layout: Layout,
    box: ArrayLike,
    lost: int = 1,
    power: float | None = None,
    free: Sequence[str] = (),
) -> ProofResult:
    """Proves or refutes a statement: any wrench of a box, any so many actuators lost, within a
    power budget. The robot is at rest in the water.

    Args:
        layout: the robot. Axes that it does not command are free: they may take any wrench.
        box: half widths (6,) of the box [N, N m]; 0: the axis is held at zero.
        lost: how many actuators may be lost at once; fewer are covered, too.
        power: most power of the whole robot [W]; None: any.
        free: further axes that may take any wrench.

    Raises:
        CommandError: a half width is negative or not finite, all axes are free, one that is free
            has a half width, or there are too many cases.
    """
    half_widths = _checked_box(layout, box, free)
    if not 0 <= lost <= layout.n:
        raise CommandError(f"lost: expected 0 to {layout.n}, got {lost}")
    if power is not None and not 0.0 < power < math.inf:
        raise CommandError(f"power: expected watts above 0, got {power:g}")
    n_cases = sum(math.comb(layout.n, count) for count in range(lost + 1))
    if n_cases > MAX_CASES:
        raise CommandError(f"lost: at most {MAX_CASES} cases are looked at, these are {n_cases}")
    statement = _statement(layout, half_widths, lost, power)
    try:
        search = _Search(layout, half_widths, lost, power)
        return search.result(statement)
    except NotSettledError as error:
        return ProofResult("not settled", statement, str(error))


def _checked_box(layout: Layout, box: ArrayLike, free: Sequence[str]) -> dict[str, float]:
    """Half widths [N, N m] of the axes that are not free, by name."""
    values = np.asarray(box, np.float64)
    if values.shape != (6,) or not (np.isfinite(values) & (values >= 0.0)).all():
        raise CommandError(f"box: expected six half widths of at least 0, got {box!r:.100}")
    unknown = [name for name in free if name not in AXES]
    if unknown:
        raise CommandError(f"free: expected axes among {', '.join(AXES)}, got {unknown[0]!r:.60}")
    half_widths: dict[str, float] = {}
    for axis, half, is_commanded in zip(AXES, values.tolist(), layout.commanded, strict=True):
        if is_commanded and axis not in free:
            half_widths[axis] = half
        elif half:
            raise CommandError(f"box: {axis} is free on this robot, expected 0, got {half:g}")
    if not any(half_widths.values()):
        raise CommandError("box: expected a half width above 0 of an axis that is not free")
    return half_widths


def _statement(layout: Layout, box: dict[str, float], lost: int, power: float | None) -> str:
    """A sentence."""
    parts = []
    for axis, half in box.items():
        unit = "N" if axis.startswith("F") else "N m"
        parts.append(f"{axis} +-{half:g} {unit}" if half else f"{axis} 0")
    who = "nothing lost" if lost == 0 else f"any {lost} lost"
    limit = "" if power is None else f", within {power:g} W"
    gone = [axis for axis in AXES if axis not in box]
    freed = f", {', '.join(gone)} free" if gone else ""
    return f"{layout.name} gives any wrench of {', '.join(parts)}{freed}, {who}{limit}."


class _Corners(NamedTuple):
    """A box and its corners."""

    low: list[Fraction]
    """Least value along each axis that counts [N, N m]."""
    high: list[Fraction]
    """Largest value along each [N, N m]."""
    names: list[str]
    """Of each corner (C) the signs along these axes, 0 where the box has no width."""
    exact: list[list[Fraction]]
    """Wrenches (C) along these axes [N, N m]."""
    wrench: Array
    """The same (C, 6)."""


class _Search:
    """The search for a proof of one statement."""

    def __init__(
        self, layout: Layout, box: dict[str, float], lost: int, power: float | None
    ) -> None:
        """Takes the robot and the statement. Raises NotSettledError: no premises are certain."""
        self._layout = replace(layout, axes=tuple(axis for axis in AXES if axis in box))
        self._box = box
        self._lost = lost
        self._power = power
        self._actuators = proof_actuators(layout, power is not None)
        if not self._actuators:
            raise NotSettledError("no actuator gives a force at rest")
        self._names = [actuator.name for actuator in self._actuators]
        self._rows = [AXES.index(axis) for axis in box]
        half_widths = list(map(_fraction, box.values()))
        self._whole = self._corners_of([-half for half in half_widths], half_widths)
        self._columns = self._exact_columns()
        self._effectiveness = np.zeros((len(self._actuators), 2, 6))
        for i, columns in enumerate(self._columns):
            for k, column in enumerate(columns):
                self._effectiveness[i, k, self._rows] = np.array(column, np.float64)
        self._tolerance = 0.0
        self._allocator: Any = None

    def _corners_of(self, low: list[Fraction], high: list[Fraction]) -> _Corners:
        """The corners of a box."""
        signs = [("+", "-") if a < b else ("0",) for a, b in zip(low, high, strict=True)]
        names = ["".join(corner) for corner in product(*signs)]
        exact = [check_proof.corner_wrench(low, high, name) for name in names]
        wrench = np.zeros((len(names), 6))
        wrench[:, self._rows] = np.array(exact, np.float64)
        return _Corners(low, high, names, exact, wrench)

    def _exact_columns(self) -> list[list[list[Fraction]]]:
        """Wrench of 1 N along each axis of each actuator, of the axes that count."""
        result = []
        for actuator in self._actuators:
            values = check_proof.numbers_in(_as_text(actuator.values))
            columns = []
            for column in check_proof.columns(values):
                columns.append([column[row] for row in self._rows])
            result.append(columns)
        return result

    def result(self, statement: str) -> ProofResult:
        """Returns the result. Raises NotSettledError: some corner is not settled."""
        cases = list(self._cases())
        share, worst_case, worst_corner = self._largest_share(cases)
        if share < 1.0:
            found = self._separated(worst_case, worst_corner)
            if found is not None:
                return self._refuted(statement, found, share)
        written = []
        for lost in cases:
            try:
                written.append({"lost": list(lost), **self._box_of(lost, self._whole, MAX_SPLITS)})
            except _CounterexampleError as error:
                return self._refuted(statement, error.example, share)
        proof = self._file("proved", cases=written)
        return ProofResult(
            verdict="proved",
            statement=statement,
            n_cases=len(written),
            n_corners=len(self._whole.names),
            largest_share=self._shown(share),
            proof=proof,
        )

    def _refuted(self, statement: str, example: dict[str, Any], share: float) -> ProofResult:
        """The result with a counterexample."""
        lost = ", ".join(example["lost"])
        signs = dict(zip(self._box, example["corner"], strict=True))
        corner = []
        for axis, sign in signs.items():
            corner.append(f"{axis} {self._box[axis] * ('-0+'.index(sign) - 1):g}")
        without = f"without {lost}" if lost else "with everything working"
        limit = "" if example["prices"][0]["watt_price"] == "0" else f" within {self._power:g} W"
        reason = f"{without} there is no wrench {', '.join(corner)}{limit}."
        return ProofResult(
            verdict="refuted",
            statement=statement,
            reason=reason[0].upper() + reason[1:],
            n_cases=1,
            n_corners=len(self._whole.names),
            largest_share=self._shown(share),
            proof=self._file("refuted", counterexample=example),
        )

    def _shown(self, share: float) -> float | None:
        """A share for people; None where it is not known, or a budget bounds it."""
        return share if self._power is None and 0.0 <= share < math.inf else None

    def _cases(self) -> Iterator[tuple[str, ...]]:
        """Names of the lost, nobody first."""
        for count in range(min(self._lost, len(self._names)) + 1):
            yield from combinations(self._names, count)

    def _file(self, verdict: str, **settled: Any) -> dict[str, Any]:
        """The values of a file."""
        return {
            "format": "finlab-proof",
            "version": 1,
            "layout": self._layout.name,
            "verdict": verdict,
            "statement": {
                "box": self._box,
                "free": [axis for axis in AXES if axis not in self._box],
                "lost": min(self._lost, len(self._names)),
                "power_w": self._power,
                "wrench_tolerance": self._tolerance,
            },
            "actuators": [actuator.values for actuator in self._actuators],
            **settled,
        }

    def _sets(self, lost: Sequence[str], parts: Sequence[Part], *, is_outer: bool) -> ForceSets:
        """The sets of forces of a case, of certain parts, or of the least that holds all that is
        possible in these parts (`is_outer`)."""
        shapes = []
        for actuator, part in zip(self._actuators, parts, strict=True):
            radius = actuator.outer_radius if is_outer else actuator.radius
            shapes.append(_shape(actuator, part, radius, is_hull=is_outer))
        effectiveness = np.zeros((1, len(shapes), 3, 6))
        effectiveness[0, :, :2] = self._effectiveness
        sets = assembled([shapes], effectiveness)
        gone = [self._names.index(name) for name in lost]
        sets.lose(0, gone)
        return sets

    @property
    def _hulls(self) -> list[Part]:
        """The whole set of each actuator."""
        return [actuator.hull for actuator in self._actuators]

    def _largest_share(self, cases: list[tuple[str, ...]]) -> tuple[float, tuple[str, ...], int]:
        """About the share of the box that holds in all cases, and the case and corner that bound
        it."""
        best = (math.inf, cases[0], 0)
        for lost in cases:
            ray = self._whole.wrench / SCALE
            sets = self._sets(lost, self._hulls, is_outer=True).repeat(len(ray))
            share = sets.reach(np.zeros_like(ray), ray, FINE)[0]
            corner = int(share.argmin())
            if share[corner] < best[0]:
                best = (float(share[corner]), lost, corner)
        return best

    def _inside(
        self, lost: Sequence[str], parts: Sequence[Part], corners: _Corners
    ) -> tuple[Array, Array]:
        """The forces of each corner of a case that lie well inside chosen parts.

        Returns:
            Lengths (C,) of rays from an inner wrench to the end of what is attainable, over the
            distance of the corner [1]: at least 1 within reach; and forces (C, n, 2) [N].
        """
        count = len(corners.names)
        sets = self._sets(lost, parts, is_outer=False).repeat(count)
        inner = np.zeros((len(parts), 2))
        for i, part in enumerate(parts):
            if self._names[i] not in lost:
                inner[i, : len(part.inner_point)] = part.inner_point
        inner_forces = np.broadcast_to(inner, (count, *inner.shape))
        origin = sets.wrench(inner_forces)
        share, _, forces = sets.reach(origin, corners.wrench / SCALE - origin, FINE)
        # From the end of the ray back to the corner: a mean with the inner forces.
        weight = np.where(share >= 1.0, 1.0 / np.maximum(share, 1.0), 1.0)[:, None, None]
        return share, inner_forces + weight * (forces - inner_forces)

    def _box_of(self, lost: tuple[str, ...], corners: _Corners, splits: int) -> dict[str, Any]:
        """A box of a case as the file has it, split at most so often. Raises _CounterexampleError:
        a corner is out of reach; NotSettledError: neither is known."""
        reason = ""
        shares = []
        for parts in part_choices(self._actuators):
            share, forces = self._inside(lost, parts, corners)
            shares.append(share)
            if share.min() < 1.0:
                continue
            try:
                return self._written_box(lost, parts, corners, forces)
            except check_proof.WrongProof as error:
                reason = str(error)
        is_reached = np.array(shares) >= 1.0
        for index in np.flatnonzero(~is_reached.any(axis=0)).tolist():
            reason = f"{self._where(lost, corners, index)}: out of reach of the convex parts tried"
            if corners is self._whole:
                found = self._separated(lost, index)
                if found is not None:
                    raise _CounterexampleError(found)
            raise NotSettledError(reason)
        if len(shares) == 1 or not splits:
            where = self._where(lost, corners, int(np.array(shares).max(axis=0).argmin()))
            raise NotSettledError(reason or f"{where}: no parts reach all corners together")
        return self._split(lost, corners, is_reached, splits)

    def _split(
        self, lost: tuple[str, ...], corners: _Corners, is_reached: NDArray[np.bool_], splits: int
    ) -> dict[str, Any]:
        """A box in two halves, along the axis whose corners on either side want other parts."""
        best = (-1, 0.0, 0)
        for k, (low, high) in enumerate(zip(corners.low, corners.high, strict=True)):
            above = np.array([name[k] == "+" for name in corners.names])
            if low == high:
                continue
            most_above = int(is_reached[:, above].sum(axis=1).max())
            most_below = int(is_reached[:, ~above].sum(axis=1).max())
            width = float((high - low) / self._whole.high[k])
            best = max(best, (most_above + most_below, width, k))
        axis = best[2]
        middle = (corners.low[axis] + corners.high[axis]) / 2
        high_below = [*corners.high]
        high_below[axis] = middle
        low_above = [*corners.low]
        low_above[axis] = middle
        below = self._corners_of(corners.low, high_below)
        above_corners = self._corners_of(low_above, corners.high)
        return {
            "axis": [*self._box][axis],
            "at": _text(middle),
            "below": self._box_of(lost, below, splits - 1),
            "above": self._box_of(lost, above_corners, splits - 1),
        }

    def _where(self, lost: Sequence[str], corners: _Corners, index: int) -> str:
        """A case and a corner, in words."""
        wrench = []
        for axis, value in zip(self._box, corners.exact[index], strict=True):
            wrench.append(f"{axis} {float(value):g}")
        return f"lost {', '.join(lost) or 'nobody'}, {', '.join(wrench)}"

    def _written_box(
        self, lost: tuple[str, ...], parts: Sequence[Part], corners: _Corners, forces: Array
    ) -> dict[str, Any]:
        """A box with forces (C, n, 2) that the checker accepts. Raises WrongProof: it does not."""
        basis = self._basis(lost, parts)
        written = {}
        for index, name in enumerate(corners.names):
            affordable = self._within_budget(lost, corners, index, forces[index])
            written[name] = self._exact(lost, basis, corners.exact[index], affordable)
        own_parts = {}
        for actuator, part in zip(self._actuators, parts, strict=True):
            if part.values and actuator.name not in lost:
                own_parts[actuator.name] = part.values
        box = {"parts": own_parts, "corners": written}
        proof = check_proof.numbers_in(_as_text(self._file("proved", cases=[box])))
        premises = check_proof.checked_premises(proof)
        check_proof.check_box(proof["cases"][0], lost, corners.low, corners.high, premises)
        return box

    def _basis(self, lost: Sequence[str], parts: Sequence[Part]) -> _Basis:
        """As many axes of working actuators as there are independent axes of the wrench."""
        labels = []
        columns = []
        for i, actuator in enumerate(self._actuators):
            if actuator.name in lost:
                continue
            for k in range(actuator.n_axes):
                labels.append((i, k))
                columns.append(self._effectiveness[i, k, self._rows] * actuator.radius)
        scaled = np.array(columns).T / SCALE[self._rows, None]
        column_order, rank = _pivots(scaled)
        chosen = column_order[:rank]
        row_order, _ = _pivots(scaled[:, chosen].T)
        rows = sorted(row_order[:rank])
        if rank < len(self._rows):
            self._tolerance = WRENCH_TOLERANCE
        matrix = []
        for row in rows:
            line = []
            for column in chosen:
                i, k = labels[column]
                line.append(self._columns[i][k][row])
            matrix.append(line)
        return _Basis([labels[column] for column in chosen], rows, _inverse(matrix))

    def _exact(
        self, lost: Sequence[str], basis: _Basis, wrench: list[Fraction], forces: Array
    ) -> dict[str, list[str]]:
        """Forces (n, 2) as fractions that give a wrench exactly, by name."""
        exact = []
        missing = [*wrench]
        for i, actuator in enumerate(self._actuators):
            own = []
            for k in range(actuator.n_axes):
                size = _rounded(float(forces[i, k]), actuator.radius)
                own.append(size)
                if actuator.name not in lost and size:
                    column = self._columns[i][k]
                    missing = [w - size * c for w, c in zip(missing, column, strict=True)]
            exact.append(own)
        left = [missing[row] for row in basis.rows]
        for (i, k), line in zip(basis.axes, basis.inverse, strict=True):
            exact[i][k] += check_proof.dot(line, left)
        result = {}
        for actuator, own in zip(self._actuators, exact, strict=True):
            if actuator.name not in lost:
                result[actuator.name] = [_text(size) for size in own]
        return result

    def _within_budget(
        self, lost: tuple[str, ...], corners: _Corners, index: int, inside: Array
    ) -> Array:
        """Forces (n, 2) of a corner within the power budget, as far inside as it allows; those
        inside where there is no budget. Raises _CounterexampleError: no forces are within it."""
        if self._power is None:
            return inside
        if self._watts(lost, inside) <= self._power:
            return inside
        result = self._answer(lost, corners.wrench[index])
        cheapest = np.zeros_like(inside)
        body = np.nan_to_num(result.forces)
        for i, actuator in enumerate(self._actuators):
            row = self._layout.names.index(actuator.name)
            for k, axis in enumerate(actuator.values["axes"]):
                cheapest[i, k] = body[row] @ axis
        if corners is self._whole and self._watts(lost, cheapest) > self._power:
            example = self._too_dear(lost, index, result.multipliers, cheapest)
            if example is not None:
                raise _CounterexampleError(example)
        for blend in BLENDS:
            mixed = blend * inside + (1.0 - blend) * cheapest
            if self._watts(lost, mixed) <= self._power * (1.0 - 1e-9):
                return mixed
        raise check_proof.WrongProof(
            f"{self._where(lost, corners, index)}: takes about "
            f"{self._watts(lost, cheapest):.6g} W, which is too near to the budget"
        )

    def _answer(self, lost: tuple[str, ...], wrench: Array) -> Any:
        """The dual's answer to a wrench (6,)."""
        from finlab.allocation import Allocator

        if self._allocator is None:
            self._allocator = Allocator(self._layout)
        return self._allocator.allocate(wrench, lost=lost)

    def _watts(self, lost: Sequence[str], forces: Array) -> float:
        """Power of forces (n, 2), rounded up as the checker does [W]."""
        total = Fraction(0)
        for actuator, own in zip(self._actuators, forces.tolist(), strict=True):
            if actuator.name not in lost:
                exact = [_rounded(size, actuator.radius) for size in own[: actuator.n_axes]]
                values = check_proof.numbers_in(_as_text({"power": actuator.values["power"]}))
                total += check_proof.most_watts(values, exact)
        return float(total)

    def _too_dear(
        self, lost: Sequence[str], index: int, multipliers: Array | None, forces: Array
    ) -> dict[str, Any] | None:
        """A counterexample by the multipliers of the least power, None where they prove nothing."""
        if multipliers is None:
            return None
        touch = {}
        for actuator, own in zip(self._actuators, forces, strict=True):
            touch[actuator.name] = decimals(np.hypot(*own))
        price = decimals(np.asarray(multipliers)[self._rows])
        prices = [{"price": price, "watt_price": "1", "touch": touch}]
        return self._accepted(lost, index, {}, prices)

    def _separated(self, lost: Sequence[str], index: int) -> dict[str, Any] | None:
        """A counterexample by planes that bound all wrenches of a case; None: none is known that
        separates the corner. Where hulls are not enough, wide arcs are cut in halves."""
        found = self._separated_by(lost, index, [])
        cut = []
        for i, actuator in enumerate(self._actuators):
            if actuator.halves and actuator.name not in lost:
                cut.append(i)
        if found is None and 0 < len(cut) <= MAX_CUT_ARCS:
            found = self._separated_by(lost, index, cut)
        return found

    def _separated_by(
        self, lost: Sequence[str], index: int, cut: list[int]
    ) -> dict[str, Any] | None:
        """A counterexample with the arcs of some actuators cut in halves, None where there is
        none."""
        cuts = {}
        for i in cut:
            actuator = self._actuators[i]
            cuts[actuator.name] = middle_of(actuator.hull)
        prices: list[dict[str, Any]] = []
        for chosen in product(*(self._actuators[i].halves for i in cut)):
            parts = self._hulls
            for i, half in zip(cut, chosen, strict=True):
                parts[i] = half
            candidates = self._prices(lost, index, parts)
            if not cut:
                for price in candidates:
                    found = self._accepted(lost, index, {}, [price])
                    if found is not None:
                        return found
                return None
            if not candidates:
                return None
            prices.append(candidates[-1])
        return self._accepted(lost, index, cuts, prices)

    def _prices(
        self, lost: Sequence[str], index: int, parts: Sequence[Part]
    ) -> list[dict[str, Any]]:
        """Prices that may separate a corner from all wrenches of chosen parts."""
        sets = self._sets(lost, parts, is_outer=True)
        wrench = self._whole.wrench[index] / SCALE
        normals = []
        # What no actuator pushes at all comes first, then the plane at the end of a ray.
        columns = sets.full_effectiveness()[0]
        solution = np.linalg.lstsq(columns.T, wrench, rcond=RANK_TOLERANCE)[0]
        left = wrench - columns.T @ solution
        if np.linalg.norm(left) > RANK_TOLERANCE * np.linalg.norm(wrench):
            normals.append(left)
        inner = np.zeros((1, len(self._actuators), 2))
        for i, part in enumerate(parts):
            if self._names[i] not in lost:
                inner[0, i, : len(part.inner_point)] = part.inner_point
        for origin in (sets.wrench(inner)[0], np.zeros(6)):
            share, normal, _ = sets.reach(origin[None], (wrench - origin)[None], FINE)
            if share[0] < 1.0:
                normals.append(normal[0])
        prices = []
        for normal in normals:
            price = (normal / SCALE)[self._rows]
            largest = np.abs(price).max()
            if largest > 0.0 and np.isfinite(largest):
                scaled = decimals(price / largest)
                prices.append({"price": scaled, "watt_price": "0", "touch": {}})
        return prices

    def _accepted(
        self, lost: Sequence[str], index: int, cuts: dict[str, Any], prices: list[dict[str, Any]]
    ) -> dict[str, Any] | None:
        """A counterexample that the checker accepts, None where it does not."""
        example = {
            "lost": list(lost),
            "corner": self._whole.names[index],
            "cuts": cuts,
            "prices": prices,
        }
        try:
            _verify(self._file("refuted", counterexample=example))
        except check_proof.WrongProof:
            return None
        return example


class _CounterexampleError(Exception):
    """A corner that takes more power than the budget."""

    def __init__(self, example: dict[str, Any]) -> None:
        super().__init__()
        self.example = example


class _Basis(NamedTuple):
    """Axes of actuators whose forces make up for what is missing of a wrench."""

    axes: list[tuple[int, int]]
    """Index of the actuator, and of its axis."""
    rows: list[int]
    """Axes of the wrench that they give, by their indices among those that count."""
    inverse: list[list[Fraction]]
    """Forces per missing wrench."""


def _shape(actuator: ProofActuator, part: Part, radius: float, *, is_hull: bool) -> Shape:
    """The forces of an actuator for the search along rays."""
    directions = np.eye(2, 3)
    least, most = actuator.values["force_n"]
    if actuator.n_axes == 1:
        ends = np.array([[least, 0.0], [most, 0.0]])
        return Shape(directions, radius, 0.0, 0.0, (ends,))
    center = part.sector_center
    half_angle = part.sector_half_angle
    angle = center + half_angle * np.linspace(-1.0, 1.0, RIM_POINTS)
    rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    if is_hull and least < 0.0 and half_angle < math.pi:
        corners = np.concatenate([rim, least / radius * rim])
        return Shape(directions, radius, center, half_angle, (_convex_hull(corners),))
    if not is_hull and part.least_ahead > SMALL_LEAST * radius:
        # Beyond the chord along which the force ahead is the least one: up to the ends of the arc,
        # or up to the rim where that is nearer.
        to_rim = math.acos(min(part.least_ahead / radius, 1.0))
        used_angle = min(half_angle, to_rim)
        angle = center + used_angle * np.linspace(-1.0, 1.0, RIM_POINTS)
        rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        width = part.least_ahead * math.tan(used_angle)
        cos = math.cos(center)
        sin = math.sin(center)
        turn = np.array([[cos, sin], [-sin, cos]])
        chord = np.array([[part.least_ahead, width], [part.least_ahead, -width]]) @ turn
        corners = np.concatenate([rim, chord])
        return Shape(directions, radius, center, half_angle, (corners,))
    return Shape(directions, radius, center, half_angle)


def _convex_hull(points: Array) -> Array:
    """The corners of the convex hull of points (P, 2), counter-clockwise."""
    from scipy.spatial import ConvexHull

    return np.asarray(points[ConvexHull(points).vertices])


def _pivots(matrix: Array) -> tuple[list[int], int]:
    """The order of columns in which each is as far as possible from the span of those before it,
    and the numerical rank (QR with column pivoting; Golub and Van Loan, 5.4)."""
    left = matrix.copy()
    order: list[int] = []
    largest = float(np.linalg.norm(matrix, axis=0).max(initial=0.0))
    for _ in range(min(matrix.shape)):
        norms = np.linalg.norm(left, axis=0)
        norms[order] = 0.0
        best = int(norms.argmax())
        if norms[best] <= RANK_TOLERANCE * largest:
            break
        order.append(best)
        direction = left[:, best] / norms[best]
        left = left - np.outer(direction, direction @ left)
    return order, len(order)


def _inverse(matrix: list[list[Fraction]]) -> list[list[Fraction]]:
    """The inverse of a square matrix in fractions, by Gauss and Jordan's elimination."""
    n = len(matrix)
    rows = []
    for i, line in enumerate(matrix):
        rows.append([*line, *(Fraction(int(i == j)) for j in range(n))])
    for i in range(n):
        pivot = max(range(i, n), key=lambda row: abs(rows[row][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        head = rows[i][i]
        rows[i] = [value / head for value in rows[i]]
        for j in range(n):
            factor = rows[j][i]
            if j != i and factor:
                rows[j] = [a - factor * b for a, b in zip(rows[j], rows[i], strict=True)]
    return [row[n:] for row in rows]


def _fraction(value: float) -> Fraction:
    """A number as it is written in a file."""
    return Fraction(repr(value))


def _rounded(size: float, largest: float) -> Fraction:
    """A force with `DIGITS` digits below those of the largest force."""
    places = DIGITS - math.floor(math.log10(largest)) if largest > 0.0 else DIGITS
    unit = Fraction(10) ** places
    return Fraction(round(Fraction(size) * unit)) / unit


def _text(value: Fraction) -> str:
    """A fraction for a file, as a decimal where it is a short one."""
    for places in range(2 * DIGITS):
        scaled = value * 10**places
        if scaled.denominator == 1:
            digits = str(abs(scaled.numerator)).rjust(places + 1, "0")
            sign = "-" if value < 0 else ""
            return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)
    return str(value)


def _as_text(value: Any) -> Any:
    """Values with their numbers as text, as the checker reads them."""
    return json.loads(json.dumps(value), parse_float=str, parse_int=str)


def _verify(proof: dict[str, Any]) -> None:
    """Has the checker look at a whole file. Raises WrongProof."""
    check_proof.check(json.dumps(proof))
