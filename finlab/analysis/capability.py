"""Capability plots: the largest steady load that a robot or ship can hold by heading, with all its
actuators and after each single loss, with a certificate of every "no".

Headings are where the load comes from, clockwise: 0 from ahead, 90 degrees from starboard. Two
kinds of plots have one form. `capability` takes a wrench for each heading, or a force alone, and
finds how much of it can be held. `dp_capability` takes the loads of DNV-ST-0111, level 1, at each
DP capability number (Beaufort's), and finds the highest number up to which all are held ([2.2.2],
[2.4.4]). Both count the power budgets of the layout's buses.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.power_budget import PowerBudget, bus_words, layout_budget
from finlab.analysis.capability_text import capability_blocks, capability_picture
from finlab.analysis.dnv_loads import WEATHER, total_load
from finlab.analysis.dnv_thrust import CONSTANT_LOSS, LOSSES, ship_sets, ship_thrusters, thrust_left
from finlab.analysis.ship_file import Ship
from finlab.analysis.split_sets import Leaf, SplitSet, largest_shares, split_set
from finlab.arrays import NEARLY, NOTHING, Array
from finlab.display import html, text
from finlab.errors import LayoutError
from finlab.forces.force_sets import shapes_of
from finlab.forces.power_sides import Sides
from finlab.forces.within_budget import check_counted, sides_of
from finlab.layout import Layout
from finlab.layout.effectiveness import own_effectiveness

HEADINGS = tuple(10.0 * k for k in range(36))
"""Headings of a plot [deg]; the standard asks for steps of at most ten degrees ([2.4.6])."""
MAX_HEADINGS = 3600
"""Most headings of a plot."""
HELD_MARGIN = 1e-9
"""Share by which a load may exceed what can be held and still counts as held [1]."""
BOW_SECTOR = 30.0
"""Headings on either side of the bow that the first number of a notation is about [deg]."""
NO_WORTH = 1e-6
"""Share of what bounds a load below which a budget that is worth so much does not bind [1]."""
THRUST = "thrust"
"""What limits a heading where no budget binds."""
DNV = "DNV-ST-0111 level 1"
"""Name of the standard."""


@dataclass(frozen=True)
class Case:
    """Actuators that do not work, and the sets of the others."""

    name: str
    lost: tuple[str, ...]
    """Those that do not work, besides those that are lost already; none of the robot as it is."""
    sets: tuple[SplitSet, ...]
    """Feasible forces of those that work."""


class Refusal(NamedTuple):
    """The certificate that no more than a share of a load can be held."""

    case: int
    heading: int
    condition: int
    """Indices of the load."""
    share: float
    """The largest share of it [1]; below 1 where it cannot be held."""
    scales: tuple[float, ...]
    """Share of the forces of each working actuator that is left [1]."""
    leaves: tuple[Leaf, ...]
    """Prices that prove it; one where all sets are convex."""


class _Buses(NamedTuple):
    """The power budgets of a plot."""

    watts: dict[str, float]
    """By the names of buses [W]."""
    of_actuator: dict[str, str]
    """The bus of each actuator that has one, by names."""


@dataclass(frozen=True)
class Capability:
    """Loads that can be held by heading, after each single loss."""

    layout: str
    """Name of the layout."""
    standard: str | None
    """The standard that the loads are from, or None."""
    unit: str
    """Unit of `values`: N, a share (1), or a DP capability number (BF)."""
    headings: tuple[float, ...]
    """H headings that the loads come from [deg], clockwise."""
    cases: tuple[Case, ...]
    """C cases; the first is the robot as it is."""
    conditions: tuple[str, ...]
    """Names of the K loads of each heading."""
    loads: Array
    """Loads (H, K, 6) on the robot [N, N m], body frame."""
    share: Array
    """Largest share (C, H, K) of each that can be held [1]; infinite without a load."""
    refusals: tuple[Refusal, ...]
    """Certificates of all loads that cannot be held; of a plot of shares, of all loads."""
    loss_costs: dict[str, Array]
    """By each loss of thrust that counts, the share (H,) that it costs of the load that the intact
    robot can hold, at the heading's limiting condition [1]."""
    buses: dict[str, float]
    """Power budgets by the names of B buses [W]; none where no power is limited."""
    budget_worth: Array
    """What each budget (C, H, K, B) is worth of all that bounds a share [1]; 0 where it does not
    bind."""

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether each load can be held (C, H, K)."""
        return np.asarray(self.share >= 1.0 - HELD_MARGIN)

    @property
    def utilisation(self) -> Array:
        """Share (C, H, K) of all forces that holds each load [1]: 1 over `share`."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.share)

    @property
    def values(self) -> Array:
        """What the plot shows (C, H): the highest number up to which all loads are held, or the
        largest share of the only load."""
        if self.standard is None:
            share = self.share[..., 0]
            # What is left of a plot's largest value by rounding is nothing.
            return np.where(share > NOTHING * share.max(initial=0.0), share, 0.0)
        # Held up to the condition before the first that is not; the calm is always held.
        return np.asarray(np.logical_and.accumulate(self.held, axis=-1).sum(axis=-1) - 1.0)

    @property
    def worst(self) -> Array:
        """The least of `values` after any single loss (H,); that of the robot as it is where there
        is no case of a loss."""
        return np.asarray(self.values[1:].min(axis=0) if len(self.cases) > 1 else self.values[0])

    @property
    def worst_case(self) -> tuple[str, ...]:
        """Names of the losses that `worst` is about (H,); the first of those alike."""
        if len(self.cases) == 1:
            return (self.cases[0].name,) * len(self.headings)
        return tuple(self.cases[k + 1].name for k in self.values[1:].argmin(axis=0))

    @property
    def limiting(self) -> NDArray[np.intp]:
        """The load (C, H) of each heading that limits the plot: the first that is not held, or the
        last."""
        if self.standard is None:
            return np.zeros(self.values.shape, np.intp)
        return np.minimum(self.values.astype(np.intp) + 1, len(self.conditions) - 1)

    @property
    def binding_buses(self) -> NDArray[np.bool_]:
        """Which buses (C, H, B) have no power left at the limiting load of each heading."""
        worth = np.take_along_axis(self.budget_worth, self.limiting[..., None, None], axis=2)
        return np.asarray(worth[:, :, 0] > NO_WORTH)

    @property
    def worst_binding_buses(self) -> NDArray[np.bool_]:
        """The same (H, B) after the loss that `worst` is about."""
        if len(self.cases) == 1:
            return np.asarray(self.binding_buses[0])
        of_losses = self.values[1:].argmin(axis=0)
        return np.asarray(self.binding_buses[1 + of_losses, np.arange(len(self.headings))])

    @property
    def limited_by(self) -> tuple[tuple[str, ...], ...]:
        """What limits each heading, C rows of H: `thrust`, or buses that have no power left, as
        `bus aft`; `power` where one budget counts for all."""
        return tuple(self._limit_words(of_case) for of_case in self.binding_buses)

    @property
    def worst_limited_by(self) -> tuple[str, ...]:
        """What limits each heading (H,) after the loss that `worst` is about."""
        return self._limit_words(self.worst_binding_buses)

    def _limit_words(self, binding: NDArray[np.bool_]) -> tuple[str, ...]:
        """What limits headings (H,) where buses (H, B) have no power left."""
        words = np.array([bus_words(name) for name in self.buses])
        return tuple(" and ".join(words[of_heading]) or THRUST for of_heading in binding)

    @property
    def notation(self) -> tuple[int, int, int, int] | None:
        """The four numbers of the standard's notation ([2.5.1]): the least within 30 degrees of the
        bow and of all headings, as the ship is and after the worst loss; None without a
        standard."""
        if self.standard is None:
            return None
        heading = np.array(self.headings) % 360.0
        is_ahead = np.minimum(heading, 360.0 - heading) <= BOW_SECTOR
        numbers = []
        for values in (self.values[0], self.worst):
            ahead = values[is_ahead] if is_ahead.any() else values
            numbers += [int(ahead.min()), int(values.min())]
        return (numbers[0], numbers[1], numbers[2], numbers[3])

    def to_dict(self) -> dict[str, Any]:
        """Returns what the JSON file holds: values, loads, sets, and the certificates, which
        `finlab.analysis.refusal_check` verifies. Infinite shares are None."""
        share = np.where(np.isfinite(self.share), self.share, np.nan)
        refusals = []
        for refusal in self.refusals:
            leaves = [leaf._asdict() | {"price": leaf.price.tolist()} for leaf in refusal.leaves]
            refusals.append(refusal._asdict() | {"leaves": leaves})
        return {
            "layout": self.layout,
            "standard": self.standard,
            "unit": self.unit,
            "notation": self.notation,
            "headings_deg": list(self.headings),
            "conditions": [{"name": name} for name in self.conditions],
            "values": self.values.tolist(),
            "worst": self.worst.tolist(),
            "worst_case": list(self.worst_case),
            "limited_by": [list(row) for row in self.limited_by],
            "worst_limited_by": list(self.worst_limited_by),
            "buses": self.buses,
            "held": self.held.tolist(),
            "share": _without_nan(share.tolist()),
            "loss_costs": {name: cost.tolist() for name, cost in self.loss_costs.items()},
            "loads": self.loads.tolist(),
            "cases": [
                {
                    "name": case.name,
                    "lost": list(case.lost),
                    "sets": [each.to_dict() for each in case.sets],
                }
                for case in self.cases
            ],
            "refusals": refusals,
        }

    def to_csv(self) -> str:
        """Returns a table of `values`: a line for each heading, a column for each case; with power
        budgets, also what limits the robot as it is, and after the worst loss."""
        names = [case.name for case in self.cases]
        limits = ["limited_by", "worst_limited_by"] if self.buses else []
        lines = [",".join(["heading_deg", *names, "worst", "worst_case", *limits])]
        limited_by = self.limited_by[0]
        worst_limited_by = self.worst_limited_by
        for h, heading in enumerate(self.headings):
            cells = [f"{value:.10g}" for value in self.values[:, h]]
            cells += [f"{self.worst[h]:.10g}", self.worst_case[h]]
            if self.buses:
                cells += [limited_by[h], worst_limited_by[h]]
            lines.append(",".join([f"{heading:g}", *cells]))
        return "\n".join(lines) + "\n"

    def __str__(self) -> str:
        return text(capability_blocks(self))

    def _repr_html_(self) -> str:
        return html(capability_blocks(self), lambda: capability_picture(self))


def _without_nan(values: Any) -> Any:
    """Nested lists with None in place of NaN, which is no JSON."""
    if isinstance(values, list):
        return [_without_nan(value) for value in values]
    return None if values != values else values


def capability(
    layout: Layout,
    loads: ArrayLike | None = None,
    headings: Sequence[float] = HEADINGS,
    lost: Collection[str] = (),
    flow: ArrayLike | None = None,
    *,
    power: object = None,
    progress: Callable[[float], object] | None = None,
) -> Capability:
    """Returns how much of a load a robot can hold by heading, and after each single loss.

    Args:
        layout: the robot.
        loads: wrench (H, 6) on the robot of each heading, none of them 0 [N, N m], body frame; None
            for 1 N horizontally from the heading, so that the values are the largest forces, in
            newton. All other axes that the robot commands are held at 0; those that it does not
            command are free, unless a load is about them.
        headings: where the loads come from (H,) [deg], clockwise from ahead.
        lost: names of actuators that do not work already.
        flow: velocity of the robot relative to the water (6,) [m/s, rad/s]; None at rest.
        power: the most that all actuators may take [W], or those of buses by name, as in
            `finlab.Allocator.allocate`; None for the budget of the layout, infinity for no limit.
        progress: called with the share that is done before each case; what it raises ends the
            computation.

    Raises:
        LayoutError: there is no actuator of a name, or the loads do not fit.
        AllocationError: the power is none, or the flow drives actuators whose power is not known.
    """
    angles = _checked_headings(headings)
    if loads is None:
        # What comes from a heading pushes the other way.
        turn = np.deg2rad(angles)
        wrench = np.zeros((len(angles), 6))
        wrench[:, 0] = -np.cos(turn)
        wrench[:, 1] = np.sin(turn)
    else:
        wrench = np.asarray(loads, np.float64)
    if wrench.shape != (len(angles), 6) or not np.isfinite(wrench).all():
        raise LayoutError(
            f"loads: expected {len(angles)} x 6 finite numbers, a wrench for each heading, got an "
            f"array of shape {wrench.shape}"
        )
    has_no_load = ~wrench.any(axis=1)
    if has_no_load.any():
        heading = angles[int(np.argmax(has_no_load))]
        raise LayoutError(
            f"loads: expected a load from each heading, got none from {heading:g} deg, of which "
            "any share is held; leave that heading out"
        )
    # An axis that a load is about counts, whether the robot commands it or not.
    counted = layout.commanded | (wrench != 0.0).any(axis=0)
    layout.indices(tuple(lost), "lost")
    effectiveness = own_effectiveness(layout) * counted
    shapes = shapes_of(layout, flow)
    budget = layout_budget(layout, power)
    sides: Sequence[Sequence[Sides]] = [()] * layout.n
    if budget is not None:
        check_counted(layout, shapes)
        sides = sides_of(layout, shapes)
    buses = _buses(layout, budget)
    every = []
    for name, gain, shape, own in zip(layout.names, effectiveness, shapes, sides, strict=True):
        every.append(split_set(name, gain, shape, own, buses.of_actuator.get(name)))
    working = [name for name in layout.names if name not in lost]
    cases = []
    for name, taken in [("intact", ()), *((name, (name,)) for name in working)]:
        sets = tuple(each for each in every if each.name not in {*lost, *taken})
        cases.append(Case(name, taken, sets))
    full = [np.ones((len(angles), 1, len(case.sets))) for case in cases]
    return _answered(
        layout=layout.name,
        standard=None,
        unit="N" if loads is None else "1",
        headings=angles,
        cases=cases,
        conditions=("load",),
        loads=wrench[:, None, :],
        scales=full,
        buses=buses.watts,
        progress=progress,
    )


def dp_capability(
    layout: Layout,
    ship: Ship,
    headings: Sequence[float] = HEADINGS,
    lost: Collection[str] = (),
    losses: Collection[str] = LOSSES,
    *,
    power: object = None,
    progress: Callable[[float], object] | None = None,
) -> Capability:
    """Returns the DP capability numbers of a ship by heading, and after each single loss, by
    DNV-ST-0111 (December 2021), level 1.

    Args:
        layout: the actuators, about whose origin the ship's `midship_m` is given.
        ship: its particulars.
        headings: where the weather comes from (H,) [deg], clockwise from ahead.
        lost: names of actuators that do not work already.
        losses: which of `LOSSES` of thrust count besides the constant one; the standard has all.
        power: as in `capability`. The power of a thrust is by [3.9.2] where the ship's file has
            a power, else that of the layout's model.
        progress: as in `capability`.

    Raises:
        LayoutError: there is no actuator of a name, or the standard has no rule for one.
        AllocationError: the power is none.
    """
    angles = _checked_headings(headings)
    unknown = [name for name in losses if name not in LOSSES]
    if unknown:
        raise LayoutError(f"losses: expected some of {', '.join(LOSSES)}, got {', '.join(unknown)}")
    layout.indices(tuple(lost), "lost")
    buses = _buses(layout, layout_budget(layout, power))
    thrusters = ship_thrusters(layout, ship, buses.of_actuator if buses.watts else None)
    turn = np.deg2rad(angles)
    loads = np.zeros((len(angles), len(WEATHER), 6))
    left = np.ones((len(thrusters), len(angles), len(WEATHER)))
    for k, weather in enumerate(WEATHER):
        loads[:, k, [0, 1, 5]] = total_load(ship, weather, turn)
        for i, thruster in enumerate(thrusters):
            left[i, :, k] = thrust_left(thruster, ship, weather, turn, "ventilation" in losses)
    cases = []
    scales = []
    for name, taken in _failures(layout, ship.groups, lost):
        without = {*lost, *taken}
        sets = ship_sets(thrusters, ship, without, losses)
        cases.append(Case(name, taken, sets))
        working = [i for i, each in enumerate(thrusters) if each.name not in without]
        scales.append(np.moveaxis(left[working], 0, -1))
    answered = _answered(
        layout=layout.name,
        standard=DNV,
        unit="BF",
        headings=angles,
        cases=cases,
        conditions=tuple(f"BF {k}" for k in range(len(WEATHER))),
        loads=loads,
        scales=scales,
        buses=buses.watts,
        progress=progress,
    )
    # The first condition that is not held, or the last of all.
    limiting = np.minimum(answered.values[0].astype(np.intp) + 1, len(WEATHER) - 1)
    each_heading = np.arange(len(angles))
    asked = -loads[each_heading, limiting]
    with_all = answered.share[0, each_heading, limiting]
    costs = {}
    for loss in losses:
        others = [name for name in losses if name != loss]
        working = [i for i, each in enumerate(thrusters) if each.name not in lost]
        scale = np.moveaxis(left[working][:, each_heading, limiting], 0, -1)
        if loss == "ventilation":
            scale = np.full_like(scale, CONSTANT_LOSS)
        sets = ship_sets(thrusters, ship, lost, others)
        share_without = largest_shares(sets, asked, scale, buses.watts).share
        is_any = share_without > 0.0
        cost = np.where(is_any, 1.0 - with_all / np.where(is_any, share_without, 1.0), 0.0)
        costs[loss] = np.where(cost > NEARLY, cost, 0.0)
    return replace(answered, loss_costs=costs)


def _failures(
    layout: Layout, groups: Mapping[str, tuple[str, ...]], lost: Collection[str]
) -> list[tuple[str, tuple[str, ...]]]:
    """Names of cases, and the actuators that each one takes: none, each one, each group."""
    failures: list[tuple[str, tuple[str, ...]]] = [("intact", ())]
    failures += [(name, (name,)) for name in layout.names if name not in lost]
    for name, members in groups.items():
        layout.indices(members, f"ship.groups.{name}")
        failures.append((name, members))
    return failures


def _buses(layout: Layout, budget: PowerBudget | None) -> _Buses:
    """The budgets of a plot by name."""
    if budget is None:
        return _Buses({}, {})
    of_actuator = {}
    for bus, members in zip(budget.names, budget.members, strict=True):
        for i in np.flatnonzero(members):
            of_actuator[layout.names[i]] = bus
    return _Buses(dict(zip(budget.names, budget.watts.tolist(), strict=True)), of_actuator)


def _checked_headings(headings: Sequence[float]) -> tuple[float, ...]:
    """Headings (H,) [deg] as numbers."""
    values = np.asarray(headings, np.float64)
    if values.ndim != 1 or not 1 <= len(values) <= MAX_HEADINGS or not np.isfinite(values).all():
        raise LayoutError(
            f"headings: expected 1 to {MAX_HEADINGS} finite angles [deg], got an array of shape "
            f"{values.shape}"
        )
    return tuple(values.tolist())


def _answered(
    layout: str,
    standard: str | None,
    unit: str,
    headings: tuple[float, ...],
    cases: Sequence[Case],
    conditions: tuple[str, ...],
    loads: Array,
    scales: Sequence[Array],
    buses: dict[str, float],
    progress: Callable[[float], object] | None,
) -> Capability:
    """A plot, by its loads (H, K, 6) and what is left of each case's actuators (C of (H, K, n));
    `progress` as in `capability`."""
    n_headings, n_conditions, _ = loads.shape
    share = np.zeros((len(cases), n_headings, n_conditions))
    budget_worth = np.zeros((*share.shape, len(buses)))
    refusals = []
    for c, (case, scale) in enumerate(zip(cases, scales, strict=True)):
        if progress is not None:
            progress(c / len(cases))
        # The actuators' wrench is to be the opposite of the load.
        flat_scale = scale.reshape(n_headings * n_conditions, -1)
        answer = largest_shares(case.sets, -loads.reshape(-1, 6), flat_scale, buses)
        share[c] = answer.share.reshape(n_headings, n_conditions)
        budget_worth[c] = answer.budget_worth.reshape(budget_worth[c].shape)
        for q, leaves in enumerate(answer.leaves):
            is_held = standard is not None and answer.share[q] >= 1.0 - HELD_MARGIN
            if leaves and not is_held:
                heading, condition = divmod(q, n_conditions)
                refusals.append(
                    Refusal(
                        case=c,
                        heading=heading,
                        condition=condition,
                        share=float(answer.share[q]),
                        scales=tuple(flat_scale[q].tolist()),
                        leaves=leaves,
                    )
                )
    return Capability(
        layout=layout,
        standard=standard,
        unit=unit,
        headings=headings,
        cases=tuple(cases),
        conditions=conditions,
        loads=loads,
        share=share,
        refusals=tuple(refusals),
        loss_costs={},
        buses=buses,
        budget_worth=budget_worth,
    )
