"""A robot out of its bundle: the layout, the fins that it has lost, and the library's own allocator."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import bundled_method
from finlab.arrays import Array
from finlab.bundle_files import Files, check_bundle_files, is_bundle, read_bundle_files
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.layout.commands import neutral_row
from finlab.layout.load import Case, robot_of


@dataclass(frozen=True)
class DeployedRobot:
    """What `finlab-runtime` works with."""

    allocator: Allocator
    """Made of the bundle's settings and, where there are any, networks."""
    failed: tuple[str, ...] = ()
    """Actuators that the bundle names as failed."""
    self_test: tuple[Case, ...] = ()
    """Targets with the answers of the computer that made the bundle."""

    @property
    def layout(self) -> Layout:
        """All fins."""
        return self.allocator.layout

    def allocate(self, wrench: ArrayLike, *, failed: Sequence[str] = (), **options: Any) -> Allocation:
        """Commands for one target; arguments and errors as in `finlab.Allocator.allocate`. What the bundle
        names as failed stays failed, whatever `failed` adds.

        Raises:
            DataError: the answer is no number, as a broken bundle gives it.
        """
        lost = (*self.failed, *(name for name in failed if name not in self.failed))
        answer = self.allocator.allocate(wrench, failed=lost, **options)
        works = [name not in lost for name in self.layout.names]
        if not np.isfinite(answer.command[works]).all():
            raise DataError(
                "the bundle answers with NaN; export it again, and run `finlab-runtime check` on it"
            )
        return answer

    def neutral(self, failed: Sequence[str] = (), now: Array | None = None) -> Array:
        """Commands (n, 3) that push least, see `neutral_row`; azimuths keep the angles of the present ones
        (n, 3), where there are any."""
        rows = [None] * self.layout.n if now is None else now
        command = np.array(
            [neutral_row(part, row) for part, row in zip(self.layout.actuators, rows, strict=True)]
        )
        command[[name in (*self.failed, *failed) for name in self.layout.names]] = np.nan
        return command


def load_robot(path: str | os.PathLike[str]) -> DeployedRobot:
    """The robot in a bundle, a folder or a zip archive.

    Raises:
        FinlabError: it is none, was changed, or cannot be run.
    """
    if not is_bundle(path) and str(path).endswith((".json", ".yaml", ".yml")) and os.path.exists(path):
        raise DataError(f"{path}: is a layout file; run what `finlab export {path} -o DIR` makes of it")
    robot = parse_robot(read_bundle_files(path), str(path))
    if robot.failed:  # what is left is prepared now, not at the first answer
        robot.allocator.allocate(np.zeros(6), failed=robot.failed)
    return robot


def parse_robot(files: Files, source: str = "bundle") -> DeployedRobot:
    """The robot in the contents of a bundle's files; see `load_robot`.

    Force tables are read from the folder or archive `source` once they are needed.
    """
    check_bundle_files(files, source)
    robot = robot_of(files, source)
    allocator = Allocator.of_choice(robot.layout, bundled_method(files, source))
    if (None if allocator.weights is None else allocator.weights.sha256) != robot.weights_sha256:
        raise DataError(f"{source}: was made with other networks than this finlab's; export it with this one")
    return DeployedRobot(allocator, robot.failed, robot.self_test)
