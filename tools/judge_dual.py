"""Judges the default method from outside: seeded robots, wrenches and plant that were written apart from it.

    python tools/judge_dual.py heavy tail within beyond ticks --n 300 --seed 1

Prints a line for each kind of robot. `over` is watts over the largest own lower bound, less 1 (where arcs
are wide or rudders brake, no answer may come near it); `dear`, where that is over 0.1 %, watts over the
least known; `gap` is what the answer's own bound leaves open; `false` counts bounds that are too high;
`miss` counts wrenches within reach that were not given, and answers out of reach that are not the nearest;
`broken` limits that were passed; `raised` answers that were none; `excess` is what is missing beyond need,
as a share.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import finlab
from finlab.arrays import Array
from tests.least_power import conic_optimum, farthest, least_known, least_miss, lower_bound
from tests.mixed_robots import (
    KINDS,
    beyond,
    bluerov2_heavy,
    fins_with_a_tail,
    load,
    random_flow,
    random_robot,
    with_dead_bands,
    with_rates,
    within,
)
from tests.own_plant import OwnPlant

REACHED = 1e-3
"""Share of the robot's scales within which a wrench counts as given."""
PER_ROBOT = 10
"""Wrenches for each random robot."""


@dataclass
class Tally:
    """What was seen of one kind of robot."""

    name: str
    count: int = 0
    misses: int = 0
    raised: int = 0
    broken: int = 0
    false: int = 0
    over: list[float] = field(default_factory=list)
    dear: list[float] = field(default_factory=list)
    gap: list[float] = field(default_factory=list)
    share: list[float] = field(default_factory=list)
    excess: list[float] = field(default_factory=list)
    milliseconds: list[float] = field(default_factory=list)
    worst: str = ""

    def show(self) -> None:
        """Prints the line."""
        parts = [f"{self.name:15s} n {self.count:5d} miss {self.misses} raised {self.raised}"]
        parts += [f"broken {self.broken} false {self.false}"]
        for name in ("over", "dear", "gap", "excess"):
            parts += [f"{name} {_spread(getattr(self, name))}"] if getattr(self, name) else []
        if self.share:
            parts.append(f"share min {min(self.share):.5f} p1 {np.quantile(self.share, 0.01):.5f}")
        if self.milliseconds:
            p50, p99 = np.quantile(self.milliseconds, [0.5, 0.99])
            parts.append(f"ms {p50:.2f} / {p99:.2f}")
        print("  ".join(parts), f"\n    worst: {self.worst}" if self.worst else "", flush=True)


def _spread(values: list[float]) -> str:
    return "p50 {:.1e} p99 {:.1e} max {:.1e}".format(*np.quantile(values, [0.5, 0.99, 1.0]))


class Asked:
    """One robot: the library's allocator and the own plant beside it."""

    def __init__(self, layout: dict[str, Any], flow: Array | None, tally: Tally, **settings: Any) -> None:
        self.plant, self.tally, self.flow = OwnPlant(layout, flow), tally, flow
        self.allocator = finlab.Allocator(load(layout), **settings)

    def ask(self, wrench: Array, label: str, **options: Any) -> tuple[Any, Array] | None:
        """The library's result and its commands (n, 3), within limits or counted; None where it raised."""
        tally = self.tally
        tally.count += 1
        if self.flow is not None:
            options["flow"] = self.flow
        start = time.process_time()
        try:
            result = self.allocator.allocate(wrench, **options)
        except Exception as error:  # whatever it is, it is counted and told
            tally.raised += 1
            tally.worst = f"{label}: {type(error).__name__}: {str(error)[:150]}"
            return None
        tally.milliseconds.append(1e3 * (time.process_time() - start))
        commands = self.plant.commands_of(result)
        if not np.isfinite(commands).all() or self.plant.excess(commands) > 1e-12:
            tally.broken += 1
            tally.worst = f"{label}: excess {self.plant.excess(commands):.1e}"
        return result, commands

    def missing(self, commands: Array, wrench: Array) -> float:
        """Length of what is missing, over the robot's scales."""
        return float(np.linalg.norm((self.plant.wrench(commands) - wrench) / self.plant.scales))

    def judge_within(self, wrench: Array, label: str, bound: float) -> None:
        """Asks for a wrench within reach; `bound` [W] is an own lower bound, or the optimum."""
        tally = self.tally
        found = self.ask(wrench, label)
        if found is None:
            return
        result, commands = found
        error = self.missing(commands, wrench)
        if error > REACHED:
            tally.misses += 1
            tally.worst = f"{label}: err {error:.1e}, notes {list(result.notes)[:2]}"
            return
        watts = self.plant.power(commands)
        if abs(watts - result.power) > 1e-6 * (1.0 + watts):
            tally.worst = f"{label}: power {result.power} against {watts} by our plant"
        over = watts / max(bound, 1e-9) - 1.0
        if over > max([*tally.over, 0.0]):
            tally.worst = tally.worst or f"{label}: over {over:.1e}"
        tally.over.append(over)
        if over > 1e-3:
            best = least_known(self.plant, wrench, 4)
            tally.dear.append(watts / min(best or watts, watts) - 1.0)
            tally.false += bool(best is not None and (result.bound or 0.0) > best * (1.0 + 1e-5))
            if tally.dear[-1] > 1e-3:
                tally.worst = f"{label}: {watts:.6g} W, known {best:.6g} W, bound {bound:.6g} W"
        if result.bound is not None:
            tally.gap.append(1.0 - result.bound / watts if watts > 0.0 else 0.0)
            tally.false += bool(result.bound > watts * (1.0 + 1e-5))


def _robots(kind: str, n: int, seed: int) -> Iterator[tuple[int, dict[str, Any], Array | None]]:
    for number in range((n + PER_ROBOT - 1) // PER_ROBOT):
        yield number, random_robot(kind, number, seed), random_flow(kind, number, seed)


def heavy(n: int, seed: int) -> None:
    """BlueROV2 Heavy within reach, against Clarabel, and beyond, against a linear and a quadratic program."""
    rng, inside = np.random.default_rng(seed), Tally("heavy within")
    asked = Asked(bluerov2_heavy(), None, inside)
    for k in range(n):
        wrench = within(asked.plant, rng)
        asked.judge_within(wrench, f"{k}", conic_optimum(asked.plant, wrench)[0])
    inside.show()
    _beyond("heavy", [(0, bluerov2_heavy(), None)], max(n // 2, 1), rng)


def _beyond(name: str, robots: Any, per_robot: int, rng: np.random.Generator) -> None:
    along, near = Tally(f"{name} direction"), Tally(f"{name} closest")
    for number, layout, flow in robots:
        one, other = Asked(layout, flow, along), Asked(layout, flow, near)
        for k in range(per_robot):
            times = float(rng.choice([1.2, 2.0, 3.0]))
            wrench = beyond(one.plant, rng, times)
            label = f"robot {number} wrench {k} times {times}"
            _judge_direction(one, wrench, times, label)
            _judge_closest(other, wrench, label)
    along.show()
    near.show()


def _judge_direction(asked: Asked, wrench: Array, times: float, label: str) -> None:
    found = asked.ask(wrench, label, policy="direction")
    if found is None:
        return
    given, scales = asked.plant.wrench(found[1]) / asked.plant.scales, asked.plant.scales
    share = float(given @ (wrench / scales) / np.square(wrench / scales).sum()) * times
    beside = float(np.linalg.norm(given - share / times * wrench / scales))
    asked.tally.share.append(share)
    asked.tally.excess.append(beside)
    if share < 0.998 or beside > REACHED:
        asked.tally.misses += 1
        asked.tally.worst = f"{label}: share {share:.5f} beside {beside:.1e}"


def _judge_closest(asked: Asked, wrench: Array, label: str) -> None:
    found = asked.ask(wrench, label)
    if found is None:
        return
    least = least_miss(asked.plant, wrench)
    size = float(np.linalg.norm(wrench / asked.plant.scales))
    excess = (asked.missing(found[1], wrench) - least) / size
    asked.tally.excess.append(excess)
    if excess > 2e-3:
        asked.tally.misses += 1
        asked.tally.worst = f"{label}: misses {excess:.1e} of the wrench more than needed"


def tail(n: int, seed: int) -> None:
    """Robots of 2 to 5 mixed fins as in split `fins-mixed`; where an answer is dear, SLSQP is asked, too."""
    tally, rng = Tally("fins with a tail"), np.random.default_rng(seed)
    for k in range(n):
        asked = Asked(fins_with_a_tail(k, seed), None, tally)
        wrench = within(asked.plant, rng, 1.0)
        asked.judge_within(wrench, f"robot {k}", lower_bound(asked.plant, wrench))
    tally.show()
    print(f"    mean over the bound {np.mean(tally.over):.2e}")


def inside(n: int, seed: int) -> None:
    """Random robots of each kind within reach."""
    for kind in KINDS:
        tally = Tally(kind)
        for number, layout, flow in _robots(kind, n, seed):
            asked, rng = Asked(layout, flow, tally), np.random.default_rng([seed, number])
            for k in range(PER_ROBOT):
                wrench = within(asked.plant, rng)
                asked.judge_within(wrench, f"robot {number} wrench {k}", lower_bound(asked.plant, wrench))
        tally.show()


def bands(n: int, seed: int) -> None:
    """Thrusters with dead bands of 0.1 to 1 N: rounded, so the wrench may be off by a little."""
    tally = Tally("dead bands")
    for number, layout, _ in _robots("thrusters", n, seed):
        rng = np.random.default_rng([seed, number])
        asked = Asked(with_dead_bands(layout, rng), None, tally)
        for k in range(PER_ROBOT):
            found = asked.ask(within(asked.plant, rng), f"robot {number} wrench {k}")
            if found is not None:
                tally.excess.append(asked.missing(found[1], found[0].target))
    tally.show()


def outside(n: int, seed: int) -> None:
    """Random robots of each kind beyond reach."""
    for kind in KINDS:
        _beyond(kind, _robots(kind, n, seed), PER_ROBOT, np.random.default_rng(seed))


def ticks(n: int, seed: int) -> None:
    """A wandering wrench on four robots, rates tight and loose: no limit and no rate broken, and the watts of
    the free answer wherever its commands lie within the rates."""
    for kind in ("fins", "thrusters", "azimuths", "mixed"):
        for name, period in (("tight", 0.02), ("loose", 0.2)):
            tally = Tally(f"{kind} {name}")
            layout = with_rates(random_robot(kind, 1, seed))
            free, held = Asked(layout, None, Tally("free")), Asked(layout, None, tally, period_s=period)
            _wander(free, held, n, period, np.random.default_rng(seed))
            tally.show()


def _wander(free: Asked, held: Asked, n: int, period: float, rng: np.random.Generator) -> None:
    plant, tally = held.plant, held.tally
    ends, before = [within(plant, rng) for _ in range(n // 50 + 2)], None
    for k in range(n):
        part = (k % 50) / 50.0
        wrench = (1.0 - part) * ends[k // 50] + part * ends[k // 50 + 1]
        options: dict[str, Any] = {} if before is None else {"previous": before}
        found, best = held.ask(wrench, f"tick {k}", **options), free.ask(wrench, f"tick {k}")
        if found is None or best is None:
            continue
        commands = found[1]
        if before is not None:
            if plant.rate_excess(before, commands, period) > 1e-9:
                tally.broken += 1
                tally.worst = f"tick {k}: rate excess {plant.rate_excess(before, commands, period):.1e}"
            _judge_tick(free, held, wrench, (before, commands, best[1]), period, k)
        before = commands


def _judge_tick(
    free: Asked, held: Asked, wrench: Array, told: tuple[Array, Array, Array], period: float, tick: int
) -> None:
    """Where the free optimum lies within the rates, the answer is as exact and as cheap; elsewhere (a
    tenth of the ticks, as this is slow) it comes as near as the hulls of what may follow allow, or gives the
    largest share of the wrench."""
    previous, commands, best = told
    plant, tally = held.plant, held.tally
    error = held.missing(commands, wrench)
    if plant.rate_excess(previous, best, period) <= 0.0 and free.missing(best, wrench) <= REACHED:
        tally.misses += error > REACHED
        over = plant.power(commands) / max(plant.power(best), 1e-9) - 1.0
        tally.over.append(over)
        if over > 5e-3 or error > REACHED:
            tally.worst = f"tick {tick}: over the free optimum {over:.1e}, err {error:.1e}"
    elif error > REACHED and tick % 10 == 0:
        near = plant.after(previous, period)
        excess = error - least_miss(near, wrench, 33)
        tally.excess.append(excess)
        if excess > 2e-3:
            given, size = plant.wrench(commands) / plant.scales, wrench / plant.scales
            share = float(given @ size / (size @ size))
            beside, most = float(np.linalg.norm(given - share * size)), farthest(near, wrench, 33)
            if beside > REACHED or share < 0.99 * min(most, 1.0):
                tally.misses += 1
                tally.worst = (
                    f"tick {tick}: err {error:.2e}, {excess:.1e} more than needed, share {share:.3f} "
                )
                tally.worst += f"of {most:.3f}, beside {beside:.1e}"


JUDGES: dict[str, Callable[[int, int], None]] = {
    "heavy": heavy,
    "tail": tail,
    "within": inside,
    "bands": bands,
    "beyond": outside,
    "ticks": ticks,
}


def main() -> None:
    """Runs the judges that were named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="+", choices=[*JUDGES, "all"], metavar="NAME", help=", ".join(JUDGES))
    parser.add_argument("--n", type=int, default=100, help="wrenches, for each kind of robot")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    for name in JUDGES if "all" in args.names else args.names:
        print(f"== {name}")
        JUDGES[name](args.n, args.seed)


if __name__ == "__main__":
    main()
