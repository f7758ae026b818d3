"""The allocator on board: answers from a bundle alone, with numpy and, where it pays, onnxruntime.

    from finlab.deploy.runtime import load

    robot = load("bundle")
    answer = robot.allocate([1, 0, 0.5, 0, 0, 0.1])

The pipeline is the library's own, so answers are the library's. Nothing here knows the analytic fin model:
wrenches and errors are those that the learned surrogate predicts.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.learned.fast import FastAllocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.policy import CLOSEST, Policy
from finlab.deploy.bundle_file import RobotBundle, read_bundle
from finlab.deploy.engine import use_engine
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.physics.energy import EnergyMeter

Array = NDArray[np.float64]


class Answer(NamedTuple):
    """Commands for one target, and what they should give."""

    fins: tuple[str, ...]
    """Names of all fins, in the order of `command`."""
    command: Array
    """(n, 3): half amplitude [rad], frequency [Hz], zero direction [rad]; NaN for a failed fin."""
    wrench: Array
    """Wrench (6,) that the surrogate predicts [N, N m]."""
    unallocated: Array
    """What is missing from the target (6,) [N, N m], by the surrogate."""
    err_norm: float
    """Normalized size of that."""
    energy: float
    """Energy proxy of the command."""
    solve_ms: float
    """Time spent solving [ms]."""
    notes: tuple[str, ...]
    """Sentences that somebody should read before trusting the answer."""


class Runtime:
    """One robot, ready to answer."""

    def __init__(self, bundle: RobotBundle, engine: str = "numpy", fast: bool = False) -> None:
        """Make it from a bundle.

        Args:
            bundle: what `read_bundle` gives.
            engine: what runs the network: `numpy`, or `onnx` for onnxruntime.
            fast: whether the distilled network answers where it reaches the target.

        Raises:
            DataError: the weights do not fit together, or the engine is unknown or missing.
        """
        self.bundle = bundle
        self.layout: Layout = bundle.graph.layout
        self.failed = bundle.graph.failed
        self._energy = EnergyMeter(self.layout.upper)
        self.engine = engine
        try:
            kind = FastAllocator if fast else LearnedAllocator
            self.allocator = kind(bundle.weights, **bundle.settings)
            use_engine(self.allocator.pipeline, bundle, engine)
            # The first answer prepares the layout, and shows whether the weights fit together at all.
            if not np.isfinite(self.allocate(np.zeros(6)).wrench).all():
                raise ValueError("answers are not finite")
        except (KeyError, IndexError, ValueError, TypeError, FloatingPointError, MemoryError) as error:
            reason = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
            raise DataError(f"the bundle's weights do not fit together ({reason}); export it again") from None

    def allocate(
        self,
        wrench: ArrayLike,
        *,
        failed: Sequence[str] = (),
        previous: ArrayLike | None = None,
        policy: Policy | str = CLOSEST,
        seed: int = 0,
    ) -> Answer:
        """Commands for one target; arguments and errors as in `finlab.Allocator.allocate`.

        Fins that the bundle names as failed stay failed, whatever `failed` adds.
        """
        lost = self.failed if len(failed) == 0 else tuple(dict.fromkeys([*self.failed, *failed]))
        result = self.allocator.allocate(
            self.layout, wrench, failed=lost, previous=previous, policy=policy, seed=seed
        )
        assert result.wrench_surrogate is not None
        missing = result.target - result.wrench_surrogate
        scaled = missing / result.sigma
        return Answer(
            fins=result.fins,
            command=result.command,
            wrench=result.wrench_surrogate,
            unallocated=missing,
            err_norm=math.sqrt(scaled.dot(scaled)),
            energy=self.energy(result.command) if lost else float(self._energy(result.command[None])[0]),
            solve_ms=result.solve_ms,
            notes=result.notes,
        )

    def energy(self, command: Array) -> float:
        """Energy proxy of a command (n, 3), NaN for failed fins."""
        return float(self._energy(np.where(np.isnan(command), 0.0, command)[None])[0])

    def neutral(self, failed: Sequence[str] = ()) -> Array:
        """Commands (n, 3) that push least: least amplitude and frequency, zero direction nearest to 0."""
        command = self.layout.lower.copy()
        upper = self.layout.upper
        command[:, 2] = np.clip(0.0, command[:, 2], upper[:, 2])
        lost = {*self.failed, *failed}
        command[[name in lost for name in self.layout.names]] = np.nan
        return command


def load(path: str | os.PathLike[str], engine: str = "numpy", fast: bool = False) -> Runtime:
    """The runtime of a bundle, a folder or a zip archive.

    Raises:
        FinlabError: the bundle is not one, was changed, or cannot be run.
    """
    return Runtime(read_bundle(path), engine, fast)
