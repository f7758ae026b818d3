"""What runs the network on board: numpy, or onnxruntime on the bundle's own file.

onnxruntime is loaded only where it is asked for: it takes longer to load than the whole rest.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.numpy_network import MixtureArrays
from finlab.allocation.pipeline import Pipeline
from finlab.deploy.bundle import NETWORK
from finlab.deploy.bundle_file import RobotBundle
from finlab.errors import DataError

Array = NDArray[Any]

ENGINES = ("numpy", "onnx")
"""What can run the network."""


def use_engine(pipeline: Pipeline, bundle: RobotBundle, engine: str) -> None:
    """Let an engine run the network of a pipeline.

    Raises:
        DataError: there is no such engine, or it is not installed.
    """
    if engine not in ENGINES:
        raise DataError(f"engine: expected one of {', '.join(ENGINES)}, got {engine!r:.40}")
    if engine == "onnx":
        # The pipeline asks the network one thing only, and both engines answer it alike.
        pipeline.network = OnnxNetwork(bundle.files[NETWORK])  # type: ignore[assignment]


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
