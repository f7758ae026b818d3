"""Makes the file of problems: `python -m finlab.bench.generate -o problems.npz` (ten minutes).

Needs CasADi (`pip install 'finlab[ipopt]'`) for the yardsticks of cost; nobody who runs the benchmark does.
"""

import argparse
import shlex
import sys
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.baselines.sqp import Sqp
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.arrays import AnyArray, Array
from finlab.bench.problems import KINDS, Problems, Robot, Sequences, Targets, save_problems
from finlab.bench.questions import error_bound, path, targets
from finlab.bench.robots import robots
from finlab.errors import FinlabError
from finlab.evaluation.cheapest_commands import CheapestCommands, has_formulas
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import own_sigma
from finlab.forces.fin_sets import planar_sets
from finlab.inference.normalization import Normalization
from finlab.layout import Layout
from finlab.layout.file import layout_to_dict
from finlab.physics import plant_of, read_table
from finlab.physics.objective import Name, Objective

SEED = 8821
"""Of the shipped file; no development run, test or report uses it."""
PER_SPLIT = 5
"""Robots of each drawn set."""
STARTS = 32
"""Random starts of IPOPT for each target and objective; twice as many of SLSQP where fins are tables."""
WALKED = ("A", "C", "hexa", "ood-fins", "limits", "fins-mixed", "big", "tiny")
"""Layouts, or sets whose first robot is meant, that follow paths."""
DOMAIN = 0xBE9E
"""Leads the seed of every yardstick."""
YARDSTICKS = {
    "sigma": "standard deviation of the robot's wrenches under 4096 uniform commands, axis by axis, no axis "
    "of force or torque below 5 % of the largest one",
    "best_error": "inside: 0, since a command gives the wrench; else the least error of the answers of "
    "methods search (closest wrench) and sqp, by the fins' own laws",
    "error_bound": "a plane beyond which no sum of the fins' forces reaches (convex hulls of what each fin "
    "can push; fins may rest wholly)",
    "power_bound": "the convex dual over the compiled fins, as exact as their tables: nearly always to a "
    "thousandth, on weak forces of soft fins to a hundredth",
    "power_best, effort_best": "cheapest end of 32 random starts of IPOPT with the wrench as a constraint "
    "(64 of SciPy's SLSQP where fins are tables)",
}
"""How each was found."""


class Answers(NamedTuple):
    """What is known of one target."""

    best_error: float
    error_bound: float
    power_best: float
    power_bound: float
    effort_best: float


class Yardsticks:
    """The best that is known for one robot.

    Args:
        layout: the robot.
        sigma: per-axis yardstick (6,).
        seed: of random starts.
    """

    def __init__(self, layout: Layout, sigma: Array, seed: int) -> None:
        own = Normalization(np.zeros(6), sigma)
        self.layout, self.sigma, self.seed = layout, sigma, seed
        self.search, self.starts = SearchAllocator(own), Sqp(own)
        self.sets = planar_sets(self.search.pipeline.prepare(layout).planar)
        self.n_starts = STARTS if has_formulas(layout) else 2 * STARTS

    def of(self, kind: str, wrench: Array) -> Answers:
        """What is known of a wrench (6,); costs only where it lies inside."""
        if kind != "inside":
            least = float(self.least_errors(wrench[None])[0])
            return Answers(least, error_bound(self.sets, wrench, self.sigma), *(np.nan,) * 3)
        found = self.search.allocate(self.layout, wrench)
        try:
            bound = self.search.bound(found)
        except FinlabError:  # where the search has missed it, nothing is proven
            bound = np.nan
        return Answers(0.0, 0.0, self._cheapest("power", wrench), bound, self._cheapest("effort", wrench))

    def least_errors(self, wrenches: Array) -> Array:
        """The least errors (N,) known for wrenches (N, 6)."""
        answers = (
            each.allocate_batch(self.layout, wrenches, seed=self.seed) for each in (self.search, self.starts)
        )
        return np.minimum(*(answer.err_norm for answer in answers))

    def _cheapest(self, objective: Name, wrench: Array) -> float:
        cheapest = CheapestCommands(Objective(objective), self.sigma)
        _, cost = cheapest.ends(self.layout, wrench, self.n_starts, self.seed)
        return float(cost[0]) if len(cost) else np.nan


def make_problems(seed: int = SEED, per_split: int = PER_SPLIT, costs: bool = True) -> Problems:
    """All problems of a seed; without costs in seconds."""
    forces: dict[str, AnyArray] = {}
    bots: list[Robot] = []
    rows: list[tuple[Any, ...]] = []
    walked: dict[str, int] = {}
    for name, drawn in robots(seed, per_split):
        bots.append(_robot(name, drawn, forces, seed, len(bots)))
        walked.setdefault(drawn.name, len(bots) - 1)
        walked.setdefault(name, len(bots) - 1)
    problems = Problems({}, tuple(bots), _targets([]), _sequences([]), forces)
    yardsticks: dict[int, Yardsticks] = {}
    for place in progress(range(len(bots)), "robot"):
        layout, sigma = problems.layout(place), problems.sigma(place)
        yardsticks[place] = own = Yardsticks(layout, sigma, seed)
        kinds, wrenches = targets(layout, own.sets, sigma, (seed, place))
        for kind, wrench in zip(kinds, wrenches, strict=True):
            known = own.of(KINDS[kind], wrench) if costs else Answers(0.0, *(np.nan,) * 4)
            rows.append((place, kind, wrench, *known))
    chosen = [(walked[name], noisy) for name in WALKED if name in walked for noisy in (False, True)]
    paths: list[tuple[Any, ...]] = []
    for k, noisy in progress(chosen, "path"):
        wrenches = path(problems.layout(k), problems.sigma(k), seed + k, noisy)
        paths.append((k, noisy, wrenches, yardsticks[k].least_errors(wrenches)))
    about = {"seed": seed, "starts": STARTS, "yardsticks": YARDSTICKS}
    return Problems(about, tuple(bots), _targets(rows), _sequences(paths), forces)


def _robot(name: str, layout: Layout, forces: dict[str, AnyArray], seed: int, place: int) -> Robot:
    """A robot as the file describes it; its force tables join `forces`."""
    description, tables = layout_to_dict(layout), {}
    for fin in description["fins"]:
        fin.pop("servo", None)
        if fin.get("model", {}).get("type") == "table":
            grid = read_table(fin["model"]["path"]).grid
            key, file = f"table_{len(forces)}", f"robot-{place}-{fin['name']}.csv"
            amplitude, frequency, direction = (axis.tolist() for axis in grid.axes)
            forces[key] = grid.values[..., :3].astype(np.float32)
            tables[file] = {
                "amplitude": amplitude,
                "frequency": frequency,
                "direction": direction,
                "force": key,
            }
            fin["model"] = {"type": "table", "path": file}
    alone = Problems(
        {}, (Robot(name, description, (1.0,) * 6, tables),), _targets([]), _sequences([]), forces
    )
    rng = np.random.default_rng((DOMAIN, seed, place))
    return Robot(name, description, tuple(own_sigma(plant_of(alone.layout(0)), rng).tolist()), tables)


def _targets(rows: list[tuple[Any, ...]]) -> Targets:
    columns = list(zip(*rows, strict=True)) or [()] * len(Targets._fields)
    robot, kind, wrench, *known = columns
    whole = (np.array(robot, np.int64), np.array(kind, np.int64), np.array(wrench, np.float64).reshape(-1, 6))
    return Targets(*whole, *(np.array(values, np.float64) for values in known))


def _sequences(rows: list[tuple[Any, ...]]) -> Sequences:
    robot, noisy, wrench, error = list(zip(*rows, strict=True)) or [()] * len(Sequences._fields)
    whole = (np.array(robot, np.int64), np.array(noisy, bool))
    return Sequences(*whole, np.array(wrench, np.float64), np.array(error, np.float64))


def main(argv: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser("python -m finlab.bench.generate", description=__doc__)
    parser.add_argument("-o", "--output", required=True, help="file to write, .npz")
    parser.add_argument("--seed", type=int, default=SEED, help="of all draws")
    arguments = parser.parse_args(argv)
    problems = make_problems(arguments.seed)
    problems.about["command"] = shlex.join(["python", "-m", "finlab.bench.generate", *argv])
    print(save_problems(problems, arguments.output))


if __name__ == "__main__":
    main(sys.argv[1:])
