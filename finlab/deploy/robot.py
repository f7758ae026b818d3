"""A robot out of its bundle: the layout, the fins that it has lost, and the library's own allocator."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.bundle_settings import METHODS_ON_BOARD
from finlab.allocation.methods import allocator_from_bundle, load_allocator
from finlab.allocation.policy import CLOSEST, Policy
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.arrays import Array
from finlab.assets import shipped_checkpoints
from finlab.bundle_files import ABOUT, GRAPH, Files, check_bundle_files, is_bundle, read_bundle_files
from finlab.deploy.graph import LayoutGraph
from finlab.deploy.graph_file import parse_graph, read_graph
from finlab.errors import AllocationError, DataError
from finlab.layout import Layout
from finlab.layout.load import bundle_graph_text


@dataclass(frozen=True)
class DeployedRobot:
    """What `finlab-runtime` works with."""

    graph: LayoutGraph
    """The robot, failed fins included, and self-tests."""
    allocator: SearchAllocator
    """Made of the bundle's settings and, where there are any, networks."""

    @property
    def layout(self) -> Layout:
        """All fins."""
        return self.graph.layout

    def lost(self, failed: Sequence[str] = ()) -> tuple[str, ...]:
        """Fins that the bundle names as failed stay failed, whatever `failed` adds."""
        return tuple(dict.fromkeys([*self.graph.failed, *failed]))

    def allocate(
        self,
        wrench: ArrayLike,
        *,
        failed: Sequence[str] = (),
        previous: ArrayLike | None = None,
        reference: ArrayLike | None = None,
        policy: Policy | str = CLOSEST,
        flow: ArrayLike | None = None,
        seed: int = 0,
    ) -> Allocation:
        """Commands for one target; arguments and errors as in `finlab.Allocator.allocate`.

        Raises:
            AllocationError: also where the answer is no number, as a broken bundle gives it.
        """
        lost = self.lost(failed)
        answer = self.allocator.allocate(
            self.layout,
            wrench,
            failed=lost,
            previous=previous,
            reference=reference,
            policy=policy,
            flow=flow,
            seed=seed,
        )
        works = [name not in lost for name in self.layout.names]
        if not np.isfinite(answer.command[works]).all():
            raise AllocationError(
                "the bundle answers with NaN; export it again, and run `finlab-runtime check` on it"
            )
        return answer

    def neutral(self, failed: Sequence[str] = ()) -> Array:
        """Commands (n, 3) that push least: least amplitude and frequency, zero direction nearest to 0."""
        command = self.layout.lower.copy()
        command[:, 2] = np.clip(0.0, command[:, 2], self.layout.upper[:, 2])
        lost = self.lost(failed)
        command[[name in lost for name in self.layout.names]] = np.nan
        return command


def load_robot(path: str | os.PathLike[str]) -> DeployedRobot:
    """The robot in a bundle, a folder or a zip archive; or in a layout graph file, which answers with the
    usual settings.

    Raises:
        FinlabError: it is neither, was changed, or cannot be run.
    """
    if is_bundle(path) or not str(path).endswith((".json", ".yaml", ".yml")):
        robot = parse_robot(read_bundle_files(path), str(path))
    elif not str(path).endswith(".json"):
        raise DataError(f"{path}: is a layout file; run what `finlab export {path} -o DIR` makes of it")
    else:
        robot = _graph_robot(read_graph(path), str(path))
    robot.allocator.pipeline.prepare(robot.graph.healthy)  # fins are compiled now, not at the first answer
    return robot


def _graph_robot(graph: LayoutGraph, source: str) -> DeployedRobot:
    allocator: Allocator | None = None
    if graph.method == SearchAllocator.name:
        allocator = SearchAllocator(graph.normalization)
    elif graph.method in METHODS_ON_BOARD and graph.checkpoint in shipped_checkpoints():
        allocator = load_allocator(graph.method, checkpoint=graph.checkpoint)
    if not isinstance(allocator, SearchAllocator) or _sha256(allocator) != graph.checkpoint_sha256:
        raise DataError(
            f"{source}: was made for method {graph.method!r}, whose networks are not here; run the bundle "
            "that `finlab export LAYOUT -o DIR` makes, which brings them"
        )
    return DeployedRobot(graph, allocator)


def _sha256(allocator: SearchAllocator) -> str | None:
    return None if allocator.weights is None else allocator.weights.sha256


def parse_robot(files: Files, source: str = "bundle") -> DeployedRobot:
    """The robot in the contents of a bundle's files; see `load_robot`.

    Force tables are read from the folder or archive `source` once they are needed.
    """
    check_bundle_files(files, source)
    graph = parse_graph(bundle_graph_text(files, source))
    allocator = allocator_from_bundle(files, source)
    assert isinstance(allocator, SearchAllocator)
    if _sha256(allocator) != graph.checkpoint_sha256:
        raise DataError(f"{source}: {GRAPH} and the weights are of different checkpoints; export again")
    if not all(map(np.array_equal, allocator.normalization, graph.normalization)):
        raise DataError(f"{source}: {GRAPH} and {ABOUT} differ in normalization; export again")
    return DeployedRobot(graph, allocator)
