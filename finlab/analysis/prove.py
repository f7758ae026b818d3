"""Proves or refutes that a robot can give any wrench of a box whichever actuators it loses.

The attainable wrenches of convex sets of forces are convex, so a box is attainable where its
corners are. `prove` finds, for each case (who is lost) and corner, forces well inside their sets by
the core's search along rays, and corrects them in rationals until their wrench is the corner
exactly. Where a wrench is out of reach, the normal of the plane that bounds the attainable wrenches
is a price that separates it: the counterexample. Sets of forces that are not convex have parts, of
which a box takes one of each actuator, or is split; a counterexample has a price for each choice of
pieces of these sets (`proof_search.py`). With a power budget, the dual's answers of least power and
its multipliers take their place. `check_proof` decides whether what was found counts: no result
says more than that it accepted the file.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import combinations
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from finlab.analysis import check_proof
from finlab.analysis.exact_forces import RANK_TOLERANCE, ExactForces, fraction_of, rounded, text_of
from finlab.analysis.proof_premises import NotSettledError, Part, decimals, proof_actuators
from finlab.analysis.proof_search import PartSearch, Tree, Tried
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import CommandError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.forces.reach import axis_ranges
from finlab.layout import Layout

Verdict = Literal["proved", "refuted", "not settled"]
"""What is known of a statement."""
MAX_CASES = 3000
"""Most cases that are looked at: two losses of up to 64 actuators."""
WRENCH_TOLERANCE = 1e-9
"""How near to a corner a wrench has to be where the robot has no authority over some direction, so
that rounded axes leave no exact answer [N, N m]."""
NO_REACH = 1e-6
"""Share of the strongest actuator's wrench below which an axis counts as out of reach [1]."""
MAX_SPLITS = 14
"""Most times that a box is split where forces are not convex, one split in the other."""
MAX_BOXES = 1000
"""Most boxes that are looked at for one statement."""
MAX_MISSES = 40
"""Most choices of parts of one statement that give all corners, but not within the budget."""
GAP_LENGTHS = (1.0, 0.5, 0.1)
"""Lengths of wrenches of the box that may need forces between arcs, over the largest one [1]."""
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
    """About the share of the box that holds in all cases at most, above 1 where there is room [1];
    None with a power budget, or where forces that are not convex refute what it promises."""
    proof: dict[str, Any] | None = field(default=None, repr=False)
    """The file, for JSON; None where nothing is settled."""

    def __str__(self) -> str:
        lines = [f"{self.verdict}: {self.statement}"]
        if self.reason:
            lines.append(self.reason)
        if self.verdict == "proved":
            lines.append(f"{self.n_cases} cases of {self.n_corners} corners, each in fractions.")
        if self.largest_share is not None:
            lines.append(f"At most about {self.largest_share:.3g} of this box holds, by floats.")
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
        half_widths = list(map(fraction_of, box.values()))
        self._whole = self._corners_of([-half for half in half_widths], half_widths)
        self._columns = self._exact_columns()
        self._effectiveness = np.zeros((len(self._actuators), 2, 6))
        for i, columns in enumerate(self._columns):
            for k, column in enumerate(columns):
                self._effectiveness[i, k, self._rows] = np.array(column, np.float64)
        self._exact_forces = ExactForces(self._actuators, self._columns, SCALE[self._rows])
        self._inner = self._inner_search()
        self._outer = self._outer_search()
        self._parts = self._inner.covers
        """The last parts that gave a box."""
        self._boxes_left = MAX_BOXES
        self._misses_left = MAX_MISSES
        self._tolerance = 0.0
        self._allocator: Any = None

    def _inner_search(self) -> PartSearch:
        """The parts of forces that are certain."""
        pieces_of = []
        inner_points = []
        for actuator in self._actuators:
            pieces = [part.piece for part in actuator.parts]
            points = [part.inner_point for part in actuator.parts]
            if len(pieces) > 1:
                pieces.insert(0, actuator.cover)
                points.insert(0, points[0])
            pieces_of.append(pieces)
            inner_points.append(points)
        return PartSearch(self._effectiveness, pieces_of, inner_points)

    def _outer_search(self) -> PartSearch:
        """The pieces of all forces that are possible."""
        pieces_of = []
        inner_points = []
        for actuator in self._actuators:
            pieces = [actuator.outer_cover, *actuator.cuts]
            pieces_of.append(pieces)
            inner_points.append([piece.middle for piece in pieces])
        return PartSearch(self._effectiveness, pieces_of, inner_points)

    def _gone(self, lost: Sequence[str]) -> list[int]:
        """Indices of the lost."""
        return [self._names.index(name) for name in lost]

    def _corners_of(self, low: list[Fraction], high: list[Fraction]) -> _Corners:
        """The corners of a box."""
        corners = check_proof.corners_of(low, high)
        names = [name for name, _ in corners]
        exact = [wrench for _, wrench in corners]
        wrench = np.zeros((len(names), 6))
        wrench[:, self._rows] = np.array(exact, np.float64)
        return _Corners(low, high, names, exact, wrench)

    def _exact_columns(self) -> list[list[list[Fraction]]]:
        """Wrench of 1 N along each axis of each actuator, of the axes that count."""
        result = []
        for actuator in self._actuators:
            columns = []
            for column in check_proof.columns(_as_read(actuator.values)):
                columns.append([column[row] for row in self._rows])
            result.append(columns)
        return result

    def result(self, statement: str) -> ProofResult:
        """Returns the result. Raises NotSettledError: some corner is not settled."""
        cases = list(self._cases())
        share, worst_case, worst_corner = self._largest_share(cases)
        if share < 1.0:
            found = self._refutation(worst_case, [self._whole.exact[worst_corner]])
            if found is not None:
                return self._refuted(statement, found, share)
        written = []
        unsettled: NotSettledError | None = None
        for lost in cases:
            try:
                written.append({"lost": list(lost), **self._box_of(lost, self._whole, MAX_SPLITS)})
            except _CounterexampleError as error:
                return self._refuted(statement, error.example, share)
            except NotSettledError as error:
                unsettled = unsettled or error
        if unsettled is not None:
            raise unsettled
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
        wrench = []
        for axis, value in example["wrench"].items():
            wrench.append(f"{axis} {float(Fraction(value)):g}")
        without = f"without {lost}" if lost else "with everything working"
        is_too_dear = bool(example["tree"].get("watt_price", 0))
        limit = f" within {self._power:g} W" if is_too_dear else ""
        reason = f"{without} there is no wrench {', '.join(wrench)}{limit}."
        return ProofResult(
            verdict="refuted",
            statement=statement,
            reason=reason[0].upper() + reason[1:],
            n_cases=1,
            n_corners=len(self._whole.names),
            largest_share=self._shown(share) if share < 1.0 else None,
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
            "version": 3,
            "layout": self._layout.name,
            "verdict": verdict,
            "statement": {
                "box": self._box,
                "free": [axis for axis in AXES if axis not in self._box],
                "lost": min(self._lost, len(self._names)),
                "power_w": self._power,
                "wrench_tolerance": self._tolerance,
            },
            "actuators": [{**actuator.values} for actuator in self._actuators],
            **settled,
        }

    def _largest_share(self, cases: list[tuple[str, ...]]) -> tuple[float, tuple[str, ...], int]:
        """About the share of the box that holds in all cases, and the case and corner that bound
        it."""
        best = (math.inf, cases[0], 0)
        wrench = self._whole.wrench
        choices = [self._outer.covers] * len(wrench)
        for lost in cases:
            share = self._outer.solve(self._gone(lost), choices, wrench, from_rest=True).share
            corner = int(share.argmin())
            if share[corner] < best[0]:
                best = (float(share[corner]), lost, corner)
        return best

    def _box_of(self, lost: tuple[str, ...], corners: _Corners, splits: int) -> dict[str, Any]:
        """A box of a case as the file has it, split at most so often. Raises _CounterexampleError:
        a wrench is out of reach; NotSettledError: neither is known."""
        self._boxes_left -= 1
        reason = ""
        failed = []
        gone = self._gone(lost)
        for tried in self._inner.common_parts(gone, corners.wrench, self._parts):
            failed.append(tried)
            if not tried.is_reached.all():
                continue
            parts = []
            for actuator, number in zip(self._actuators, tried.choice, strict=True):
                parts.append(actuator.parts[max(number - 1, 0)])
            try:
                box = self._written_box(lost, parts, corners, tried.force)
            except check_proof.WrongProof as error:
                reason = str(error)
                self._misses_left -= 1
                if self._misses_left <= 0:
                    break
                continue
            self._parts = tried.choice
            return box
        wrenches = [*corners.exact, self._middle(corners)]
        if corners is self._whole:
            wrenches += self._wrenches_between_arcs(lost)
        example = self._refutation(lost, wrenches)
        if example is not None:
            raise _CounterexampleError(example)
        is_convex = all(len(actuator.parts) == 1 for actuator in self._actuators)
        if is_convex or not splits or min(self._boxes_left, self._misses_left) <= 0:
            missed = int(failed[-1].is_reached.argmin()) if failed else 0
            where = self._where(lost, corners, missed)
            raise NotSettledError(reason or f"{where}: out of reach of the convex parts tried")
        return self._split(lost, corners, failed, splits)

    def _middle(self, corners: _Corners) -> list[Fraction]:
        """The wrench in the middle of a box."""
        return [(low + high) / 2 for low, high in zip(corners.low, corners.high, strict=True)]

    def _wrenches_between_arcs(self, lost: Sequence[str]) -> list[list[Fraction]]:
        """Wrenches of the box that may need forces in directions that no arc has."""
        half_widths = np.array(list(self._box.values()))
        gone = self._gone(lost)
        working = [i for i in range(len(self._actuators)) if i not in gone]
        if not working:
            return []
        # Forces of least size over the largest, f = R R B^T (B R R B^T)^-1 w, of w within the box.
        radius = np.array([actuator.radius for actuator in self._actuators])
        own = self._effectiveness[working][..., self._rows] * radius[working, None, None]
        matrix = own.reshape(2 * len(working), -1).T / SCALE[self._rows, None]
        scaled_box = np.diag(half_widths / SCALE[self._rows])
        answers = np.linalg.pinv(matrix, rcond=RANK_TOLERANCE) @ scaled_box
        found = []
        for row, i in enumerate(working):
            for direction in _directions_between(self._actuators[i].arcs):
                force = answers[2 * row : 2 * row + 2]
                alone = own[row].T @ direction
                shares = [np.linalg.pinv(force) @ direction]
                shares.append(
                    np.where(half_widths > 0.0, alone / np.maximum(half_widths, 1e-300), 0.0)
                )
                for share in shares:
                    largest = np.abs(share).max(initial=0.0)
                    if not 0.0 < largest < math.inf:
                        continue
                    for length in GAP_LENGTHS:
                        found.append(self._in_box(length / largest * share * half_widths))
        return found

    def _in_box(self, wrench: Array) -> list[Fraction]:
        """A wrench of the axes that count, with few digits and within the box."""
        exact = []
        for value, half in zip(wrench.tolist(), self._whole.high, strict=True):
            short = rounded(value, float(half))
            exact.append(min(max(short, -half), half))
        return exact

    def _split(
        self, lost: tuple[str, ...], corners: _Corners, failed: Sequence[Tried], splits: int
    ) -> dict[str, Any]:
        """A box in two halves, along the axis whose corners on either side want other parts."""
        is_reached = np.zeros((len(failed) + 1, len(corners.names)), bool)
        for row, tried in enumerate(failed):
            is_reached[row] = tried.is_reached
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
        middle = self._middle(corners)[axis]
        high_below = [*corners.high]
        high_below[axis] = middle
        low_above = [*corners.low]
        low_above[axis] = middle
        below = self._corners_of(corners.low, high_below)
        above_corners = self._corners_of(low_above, corners.high)
        return {
            "axis": [*self._box][axis],
            "at": text_of(middle),
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
        basis = self._exact_forces.basis(lost, parts)
        if len(basis.rows) < len(self._rows):
            self._tolerance = WRENCH_TOLERANCE
        written = {}
        for index, name in enumerate(corners.names):
            affordable = self._within_budget(lost, parts, corners, index, forces[index])
            wrench = corners.exact[index]
            written[name] = self._exact_forces.forces(lost, basis, wrench, affordable)
        box = {"corners": written}
        robot = check_proof.checked_robot(_as_read(self._file("proved")))
        check_proof.check_box(box, lost, corners.low, corners.high, robot)
        return box

    def _within_budget(
        self,
        lost: tuple[str, ...],
        parts: Sequence[Part],
        corners: _Corners,
        index: int,
        inside: Array,
    ) -> Array:
        """Forces (n, 2) of a corner within the power budget, as far inside as it allows; those
        inside where there is no budget. Raises _CounterexampleError: no forces are within it."""
        if self._power is None:
            return inside
        if self._watts(lost, parts, inside) <= self._power:
            return inside
        result = self._answer(lost, corners.wrench[index])
        cheapest = np.zeros_like(inside)
        body = np.nan_to_num(result.forces)
        for i, actuator in enumerate(self._actuators):
            row = self._layout.names.index(actuator.name)
            for k, axis in enumerate(actuator.values["axes"]):
                cheapest[i, k] = body[row] @ axis
        if self._watts(lost, parts, cheapest) > self._power:
            wrench = corners.exact[index]
            example = self._too_dear(lost, wrench, result.multipliers)
            if example is not None:
                raise _CounterexampleError(example)
        for blend in BLENDS:
            mixed = blend * inside + (1.0 - blend) * cheapest
            if self._watts(lost, parts, mixed) <= self._power * (1.0 - 1e-9):
                return mixed
        raise check_proof.WrongProof(
            f"{self._where(lost, corners, index)}: takes about "
            f"{self._watts(lost, parts, cheapest):.6g} W, which is too near to the budget"
        )

    def _answer(self, lost: tuple[str, ...], wrench: Array) -> Any:
        """The dual's answer to a wrench (6,)."""
        from finlab.allocation import Allocator

        if self._allocator is None:
            self._allocator = Allocator(self._layout)
        return self._allocator.allocate(wrench, lost=lost)

    def _watts(self, lost: Sequence[str], parts: Sequence[Part], forces: Array) -> float:
        """Power of forces (n, 2) of parts, rounded up as the checker does [W]."""
        total = Fraction(0)
        for actuator, part, own in zip(self._actuators, parts, forces.tolist(), strict=True):
            if actuator.name not in lost:
                exact = [rounded(size, actuator.radius) for size in own[: actuator.n_axes]]
                total += check_proof.most_watts(_as_read(actuator.values), exact, part.is_ahead)
        return float(total)

    def _too_dear(
        self, lost: Sequence[str], wrench: list[Fraction], multipliers: Array | None
    ) -> dict[str, Any] | None:
        """A counterexample by the multipliers of the least power, None where they prove nothing."""
        if multipliers is None:
            return None
        price = decimals(np.asarray(multipliers)[self._rows])
        tree = {"price": price, "watt_price": 1}
        return self._accepted(lost, wrench, tree)

    def _refutation(
        self, lost: Sequence[str], wrenches: list[list[Fraction]]
    ) -> dict[str, Any] | None:
        """A counterexample among wrenches by planes that bound all wrenches of a case; None: none
        is known that parts one of them."""
        floats = np.zeros((len(wrenches), 6))
        floats[:, self._rows] = np.array(wrenches, np.float64)
        for tree, wrench in zip(self._outer.trees(self._gone(lost), floats), wrenches, strict=True):
            if tree is None:
                continue
            written = self._written_tree(lost, wrench, tree)
            if written is not None:
                found = self._accepted(lost, wrench, written)
                if found is not None:
                    return found
        return None

    def _written_tree(
        self, lost: Sequence[str], wrench: list[Fraction], tree: Tree
    ) -> dict[str, Any] | None:
        """A tree as a file has it; None: some of its planes does not part the wrench."""
        if tree.normal is not None:
            return self._separating_price(lost, wrench, tree)
        branches = []
        for branch in tree.branches:
            written = self._written_tree(lost, wrench, branch)
            if written is None:
                return None
            branches.append(written)
        return {"cut": self._actuators[tree.actuator].name, "each": branches}

    def _separating_price(
        self, lost: Sequence[str], wrench: list[Fraction], tree: Tree
    ) -> dict[str, Any] | None:
        """A price that parts a wrench from all forces of a choice of pieces; None: none is
        known."""
        robot = check_proof.checked_robot(_as_read(self._file("refuted")))
        sides = {}
        for own, number in zip(self._actuators, tree.choice, strict=True):
            if own.name in lost:
                continue
            every = check_proof.sides_of(robot[0][own.name], "outer_force_n")
            sides[own.name] = [every[number - 1]] if number else every
        for normal in self._normals(lost, wrench, tree):
            price = (normal / SCALE)[self._rows]
            largest = np.abs(price).max()
            if not 0.0 < largest < math.inf:
                continue
            leaf = {"price": decimals(price / largest), "watt_price": 0}
            try:
                check_proof.check_price(_as_read(leaf), wrench, sides, robot)
            except check_proof.WrongProof:
                continue
            return leaf
        return None

    def _normals(self, lost: Sequence[str], wrench: list[Fraction], tree: Tree) -> Iterator[Array]:
        """Normals (6,) of planes that may part a wrench from all of a choice of pieces, scaled."""
        assert tree.normal is not None
        row = np.zeros(6)
        row[self._rows] = np.array(wrench, np.float64)
        scaled = row / SCALE
        # What no actuator pushes at all comes first, then the plane at the end of a ray.
        gone = self._gone(lost)
        columns = []
        for i, actuator in enumerate(self._actuators):
            if i not in gone:
                columns += list(self._effectiveness[i] * actuator.radius / SCALE)
        matrix = np.array(columns).reshape(-1, 6)
        solution = np.linalg.lstsq(matrix.T, scaled, rcond=RANK_TOLERANCE)[0]
        left = scaled - matrix.T @ solution
        if np.linalg.norm(left) > RANK_TOLERANCE * np.linalg.norm(scaled):
            yield left
        yield tree.normal
        if row.any():
            yield self._outer.solve(gone, [tree.choice], row[None], from_rest=True).normal[0]

    def _accepted(
        self, lost: Sequence[str], wrench: list[Fraction], tree: dict[str, Any]
    ) -> dict[str, Any] | None:
        """A counterexample that the checker accepts, None where it does not."""
        example = {
            "lost": list(lost),
            "wrench": dict(zip(self._box, map(text_of, wrench), strict=True)),
            "tree": tree,
        }
        try:
            _verify(self._file("refuted", counterexample=example))
        except check_proof.WrongProof:
            return None
        return example


class _CounterexampleError(Exception):
    """A wrench that is out of reach, or takes more power than the budget."""

    def __init__(self, example: dict[str, Any]) -> None:
        super().__init__()
        self.example = example


def _directions_between(arcs: Sequence[tuple[float, float]]) -> list[Array]:
    """Directions (2,) in the middle of what several arcs, or one that is wider than half a turn,
    leave out, and beside its ends."""
    if not arcs or (len(arcs) == 1 and arcs[0][1] - arcs[0][0] <= math.pi):
        return []
    found = []
    for (_, low), (following, _) in zip(arcs, [*arcs[1:], arcs[0]], strict=True):
        width = (following - low) % (2.0 * math.pi)
        for share in (0.5, 0.1, 0.9):
            angle = low + share * width
            found.append(np.array([math.cos(angle), math.sin(angle)]))
    return found


def _as_read(values: Any) -> Any:
    """Values with their numbers as fractions, as the checker reads them."""
    return check_proof.read(json.dumps(values))


def _verify(proof: dict[str, Any]) -> None:
    """Has the checker look at a whole file. Raises WrongProof."""
    check_proof.check(json.dumps(proof))
