"""What runs the network on board: numpy, or onnxruntime on the bundle's own file.

onnxruntime is loaded only where it is asked for: it takes longer to load than the whole rest.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.pipeline import Pipeline
from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.proposal import Proposal, propose
from finlab.allocation.learned.settings import Settings
from finlab.deploy.bundle import NETWORK
from finlab.deploy.bundle_file import RobotBundle
from finlab.deploy.onnx.model import model_bytes
from finlab.deploy.onnx.proposal import proposal_model
from finlab.errors import DataError
from finlab.inference.network import MixtureArrays
from finlab.inference.weights import TrainedWeights

Array = NDArray[Any]

ENGINES = ("numpy", "onnx")
"""What can run the network."""
SEED = 0
"""The seed whose draws are built into models; all others are drawn by numpy."""
MOST_LAYOUTS = 32
"""Layouts (one for each set of lost fins) whose models are kept."""


def use_engine(pipeline: Pipeline, bundle: RobotBundle, engine: str) -> None:
    """Let an engine run the network of a pipeline.

    Raises:
        DataError: there is no such engine, or it is not installed.
    """
    if engine not in ENGINES:
        raise DataError(f"engine: expected one of {', '.join(ENGINES)}, got {engine!r:.40}")
    if engine == "onnx":
        network = OnnxNetwork(bundle.files[NETWORK])
        pipeline.propose = OnnxProposer(network, bundle.weights, pipeline.settings)


class OnnxSession:
    """An ONNX file from a checked bundle, on one core."""

    def __init__(self, content: bytes) -> None:
        """Load it.

        Raises:
            DataError: onnxruntime is missing or refuses the file.
        """
        try:
            import onnxruntime
        except ImportError:
            raise DataError("onnxruntime is not installed; pip install onnxruntime") from None
        options = onnxruntime.SessionOptions()
        # An allocation takes less than it costs to wake a second thread.
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 3
        try:
            self._session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime's own kinds of error derive from nothing narrower
            raise DataError(f"onnxruntime refuses the network: {str(error).splitlines()[0][:120]}") from None
        self.version = str(onnxruntime.__version__)

    def run(self, **inputs: Array) -> list[Array]:
        """The outputs, in order, for inputs by name."""
        return list(self._session.run(None, inputs))


class OnnxNetwork:
    """Stands in for `NumpyNetwork`."""

    def __init__(self, content: bytes) -> None:
        """Take over the contents of `network.onnx`."""
        self._session = OnnxSession(content)

    def __call__(
        self, x: Array, target: Array, lower: NDArray[np.floating], upper: NDArray[np.floating]
    ) -> MixtureArrays:
        """The mixture; arguments as in `NumpyNetwork`."""
        ends = (end.astype(np.float32) for end in (lower, upper))
        given = dict(zip(("lower", "upper"), ends, strict=True))
        return MixtureArrays(*self._session.run(features=x, target=target, **given))


class OnnxProposer:
    """Lets onnxruntime make whole proposals, one target at a time; a model is built for each layout met.

    That takes a few hundredths of a second when a layout, or a robot that has just lost a fin, is new; after
    that, a proposal takes half of numpy's time.
    """

    def __init__(self, network: OnnxNetwork, weights: TrainedWeights, settings: Settings) -> None:
        """Take over checked weights."""
        self._network, self._weights, self._settings = network, weights, settings
        self._sessions: OrderedDict[int, tuple[Prepared, OnnxSession]] = OrderedDict()

    def __call__(
        self,
        prepared: Prepared,
        centred: Array,
        target: Array,
        n_candidates: int,
        temperature: float,
        seed: int,
        /,
    ) -> Proposal:
        """As `propose`; many targets, or another seed than 0, go by steps."""
        if len(target) != 1 or seed != SEED or n_candidates <= self._weights.check_network().n_components:
            return propose(self._network, prepared, centred, target, n_candidates, temperature, seed)
        parts = self._session(prepared).run(
            target=centred.astype(np.float32), wanted=target.astype(np.float32)
        )
        command, component, wrench, error, thrust, energy = (part[None] for part in parts)
        return Proposal(command, component.astype(np.int64), wrench, error, thrust, energy)

    def _session(self, prepared: Prepared) -> OnnxSession:
        """The model of a layout, from those kept or made now."""
        # The layout itself is kept beside its model, so that its identity is not given to another one.
        kept = self._sessions.get(id(prepared))
        if kept is None:
            model = proposal_model(self._weights, prepared, self._settings, SEED)
            kept = prepared, OnnxSession(model_bytes(model))
            self._sessions[id(prepared)] = kept
            if len(self._sessions) > MOST_LAYOUTS:
                self._sessions.popitem(last=False)
        return kept[1]
