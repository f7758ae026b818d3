"""Loads a robot from its bundle, and checks that its answers on this computer are right.

`finlab-runtime check` runs the checks on the robot before first use: the actuators' laws and tables
give the same wrenches here as where the bundle was made, they confirm this computer's answers, and
targets far out of reach have an answer.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.bundled_method import bundled_method
from finlab.allocation.methods import method_class
from finlab.allocation.policy import POLICY_NAMES
from finlab.allocation.question import askable
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.bundle_files import Files, check_bundle_files, is_bundle, read_bundle_files
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.layout.bundled_robot import SelfTestCase, robot_of
from finlab.layout.load import parse_layout
from finlab.physics import plant_of
from finlab.physics.objective import REACHED

N_SELF_TEST = 4
"""Wrenches of the self-test in a bundle: enough to notice a wrong file, few enough to read."""
SELF_TEST_TOLERANCE = 1e-6
"""Allowed normalized error between the wrench of a self-test's command and what another machine
computes for it; both are written with nine digits."""
MAX_ERROR_RATIO = 1.5
"""Largest error of own answers over that of the stored ones, where these do not reach their
targets."""
EXTREME_SIZE = 10.0
"""Size of an extreme target over the wrench scale: beyond the reach of any robot."""


@dataclass(frozen=True)
class DeployedRobot:
    """A robot in its bundle, as `finlab-runtime` uses it."""

    allocator: Allocator
    """The allocator of the bundle's settings and, where there are any, networks."""
    lost: tuple[str, ...] = ()
    """Actuators that the bundle names as lost."""
    self_test: tuple[SelfTestCase, ...] = ()
    """Targets with the answers of the computer that made the bundle."""

    @property
    def layout(self) -> Layout:
        """The layout with all actuators."""
        return self.allocator.layout

    def allocate(
        self, wrench: ArrayLike, *, lost: Sequence[str] = (), **options: Any
    ) -> Allocation:
        """Returns the answer to a target; further arguments and errors as in `Allocator.allocate`.

        Args:
            wrench: target (6,) [N, N m] in the body frame.
            lost: actuators that are lost besides those that the bundle names.
            **options: further arguments of `finlab.Allocator.allocate`.

        Raises:
            DataError: the answer is no number, as a broken bundle gives it.
        """
        all_lost = (*self.lost, *(name for name in lost if name not in self.lost))
        answer = self.allocator.allocate(wrench, lost=all_lost, **options)
        damage = options.get("damage")
        broken = all_lost if damage is None else (*all_lost, *damage.lost)
        works = [name not in broken for name in self.layout.names]
        if not np.isfinite(answer.command[works]).all():
            raise DataError(
                "the bundle answers with NaN; export it again, and run `finlab-runtime check` on it"
            )
        return answer

    def neutral(self, lost: Sequence[str] = (), present: Array | None = None) -> Array:
        """Returns the commands (n, 3) that push least, see `Actuator.neutral`; NaN for lost ones.

        Args:
            lost: actuators that are lost besides those that the bundle names.
            present: present commands (n, 3); None where there are none.
        """
        rows = [None] * self.layout.n if present is None else present
        command = np.array(
            [
                actuator.neutral(row)
                for actuator, row in zip(self.layout.actuators, rows, strict=True)
            ]
        )
        command[[name in (*self.lost, *lost) for name in self.layout.names]] = np.nan
        return command


def load_robot(path: str | os.PathLike[str]) -> DeployedRobot:
    """Returns the robot in a bundle, a folder or a zip archive.

    Raises:
        FinlabError: it is no bundle, was changed, or cannot be run.
    """
    if (
        not is_bundle(path)
        and str(path).endswith((".json", ".yaml", ".yml"))
        and os.path.exists(path)
    ):
        raise DataError(
            f"{path}: is a layout file; run what `finlab export {path} -o DIR` makes of it"
        )
    robot = parse_robot(read_bundle_files(path), str(path))
    if robot.lost:  # what is left is prepared now, not at the first answer
        robot.allocator.allocate(np.zeros(6), lost=robot.lost)
    return robot


def parse_robot(files: Files, source: str = "bundle") -> DeployedRobot:
    """Returns the robot in the contents of a bundle's files; errors as in `load_robot`.

    Args:
        files: the contents by name.
        source: the folder or archive from which force tables are read when they are needed.
    """
    check_bundle_files(files, source)
    robot = robot_of(files, source, parse_layout)
    allocator = Allocator.of_choice(robot.layout, bundled_method(files, source))
    if (None if allocator.networks is None else allocator.networks.sha256) != robot.weights_sha256:
        raise DataError(
            f"{source}: was made with other networks than this finlab's; export it with this one"
        )
    return DeployedRobot(allocator, robot.lost, robot.self_test)


class Finding(NamedTuple):
    """The result of one check."""

    question: str
    """What was compared."""
    value: float
    """Largest difference; NaN where an answer was no number."""
    limit: float
    """Largest difference allowed."""

    @property
    def good(self) -> bool:
        """Whether the robot may be trusted in this respect; NaN is never good."""
        return self.value <= self.limit


def self_tests(allocator: Allocator, lost: tuple[str, ...]) -> tuple[SelfTestCase, ...]:
    """Returns targets within reach, wrenches of random commands, with an allocator's answers.

    They depend on the layout and the allocator alone.

    Args:
        allocator: the allocator of a bundle.
        lost: actuators that the bundle names as lost.

    Raises:
        LayoutError: an unknown lost actuator, or none left.
        DataError: a force table cannot be read.
    """
    layout = allocator.layout
    plant = plant_of(layout.without(lost) if lost else layout)
    cases = []
    for wrench in plant.wrench(plant.sample(np.random.default_rng(0), (N_SELF_TEST,))):
        target = _rounded(askable(wrench))
        answer = _rounded(allocator.allocate(target, lost=lost).command)
        delivered = _rounded(plant.wrench(answer[~np.isnan(answer).any(axis=1)]))
        rows = [
            None if name in lost else tuple(row)
            for name, row in zip(layout.names, answer.tolist(), strict=True)
        ]
        cases.append(SelfTestCase(tuple(target.tolist()), tuple(rows), tuple(delivered.tolist())))
    return tuple(cases)


def self_check(robot: DeployedRobot) -> list[Finding]:
    """Repeats the self-test of the bundle on this computer.

    Raises:
        DataError: the bundle has no self-test, or a force table cannot be read.
    """
    if not robot.self_test:
        raise DataError("the bundle has no self-tests; export it again")
    layout = robot.layout
    lost = robot.lost
    working = [i for i, name in enumerate(layout.names) if name not in lost]
    plant = plant_of(layout.without(lost) if lost else layout)
    scale = robot.allocator.scale
    differences = []
    errors = []
    allowed = REACHED
    for case in robot.self_test:
        stored = plant.wrench(np.array([case.command[i] for i in working], dtype=np.float64))
        differences.append(
            float(np.linalg.norm((stored - np.array(case.delivered_wrench)) / scale))
        )
        errors.append(robot.allocator.allocate(case.wrench, lost=lost).err_norm)
        missing = (stored - np.array(case.wrench)) * layout.commanded / scale
        allowed = max(allowed, MAX_ERROR_RATIO * float(np.linalg.norm(missing)))
    return [
        Finding(
            "wrench of the stored commands (err_norm)",
            float(np.max(differences)),
            SELF_TEST_TOLERANCE,
        ),
        Finding(
            "own answers, judged by the actuators' own laws (err_norm)",
            float(np.max(errors)),
            allowed,
        ),
    ]


def extremes(robot: DeployedRobot) -> Finding:
    """Asks for wrenches far out of reach: along each axis both ways, by each policy of the method,
    with each actuator lost. The value counts those without an answer; the question names the
    first of them."""
    layout = robot.layout
    unanswered = []
    n = 0
    reads_policy = "policy" in method_class(robot.allocator.method).reads
    kinds = POLICY_NAMES if reads_policy else POLICY_NAMES[:1]
    alive = [name for name in layout.names if name not in robot.lost]
    for lost in [(), *([name] for name in alive if len(alive) > 1)]:
        for policy, i in product(kinds, np.flatnonzero(layout.commanded)):
            for sign in (-1.0, 1.0):
                target = np.zeros(6)
                target[i] = sign * EXTREME_SIZE * robot.allocator.scale[i]
                target = askable(target)
                n = n + 1
                try:
                    robot.allocate(target, lost=lost, policy=policy)
                except Exception as error:  # each is a finding
                    first = (
                        f"{policy} {'+' if sign > 0.0 else '-'}{AXES[i]}, "
                        f"{' '.join(lost) or 'none'} lost"
                    )
                    unanswered.append(f"{first}: {type(error).__name__}: {error!s:.100}")
    first = f", first {unanswered[0]}" if unanswered else ""
    return Finding(f"extremes without an answer, of {n}{first}", float(len(unanswered)), 0.0)


def _rounded(values: Array) -> Array:
    """Nine significant digits: more than any servo has, and the same text on most machines."""
    return np.array([float(f"{value:.9g}") for value in values.flat]).reshape(values.shape)
