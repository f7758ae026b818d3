"""`finlab-runtime check`: does this computer answer as the one that made the bundle?

To be run on the robot before first use. Four questions for each self-test of the graph file: are the node
features the same, does the surrogate predict the same wrench, do the ONNX files agree with the arrays taken
out of them, and is this computer's own answer as good.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.proposal import predict
from finlab.deploy.bundle import FAST, NETWORK, SURROGATE
from finlab.deploy.engine import OnnxNetwork, OnnxSession
from finlab.deploy.graph import SELF_TEST_TOLERANCE, SelfTest
from finlab.deploy.runtime import Runtime
from finlab.errors import DataError
from finlab.inference.fast_network import NumpyFastNetwork
from finlab.inference.features import fin_frame_features

Array = NDArray[Any]

FEATURE_TOLERANCE = 1e-6
"""Largest difference of a node feature; they are written with nine digits."""
ONNX_TOLERANCE = 1e-4
"""Largest difference between an ONNX file's answer and numpy's, in normalized units."""
ENERGY_TOLERANCE = 0.01
"""Largest share by which an answer may cost more than the stored one."""


class Finding(NamedTuple):
    """One question and its answer."""

    question: str
    """What was compared."""
    value: float
    """Largest difference found; NaN where the question could not be asked."""
    limit: float
    """Largest difference allowed."""

    @property
    def good(self) -> bool:
        """Whether the robot may be trusted in this respect."""
        return not self.value > self.limit


def self_check(runtime: Runtime) -> list[Finding]:
    """Ask everything; a question that needs onnxruntime has NaN where that is not installed.

    Own answers are those of the full pipeline, also where the fast path runs: they are what was stored.
    """
    runtime = Runtime(runtime.bundle, runtime.engine)
    cases = runtime.bundle.graph.self_test
    alive = [i for i, name in enumerate(runtime.layout.names) if name not in runtime.failed]
    healthy = runtime.layout.without(runtime.failed) if runtime.failed else runtime.layout
    prepared = runtime.allocator.pipeline.prepare(healthy)
    normalization = runtime.bundle.graph.normalization
    std = normalization.std

    def features(case: SelfTest) -> float:
        scaled = (np.array(case.wrench) - normalization.mean) / std
        seen = fin_frame_features(prepared.geometry, scaled[None])[0]
        stored = np.array([case.features[i] for i in alive])
        return float(np.abs(seen - stored).max()) if seen.shape == stored.shape else np.inf

    def physics(case: SelfTest) -> float:
        command = np.array([case.command[i] for i in alive])
        predicted = prepared.commands.wrench(command[None])[0] * std
        return float(normalization.error(predicted, np.array(case.predicted_wrench)))

    findings = [
        Finding("node features", _worst(map(features, cases)), FEATURE_TOLERANCE),
        Finding("wrench of the stored commands (err_norm)", _worst(map(physics, cases)), SELF_TEST_TOLERANCE),
    ]
    findings += _onnx_findings(runtime, alive)
    answers = [runtime.allocate(case.wrench) for case in cases]
    stored = [np.array([row or (np.nan,) * 3 for row in case.command]) for case in cases]
    pairs = list(zip(answers, cases, stored, strict=True))
    missing = _worst(
        answer.err_norm - float(normalization.error(np.array(case.predicted_wrench), np.array(case.wrench)))
        for answer, case, _ in pairs
    )
    dearer = _worst(answer.energy / max(runtime.energy(command), 1e-9) - 1 for answer, _, command in pairs)
    return [
        *findings,
        Finding("own answers, more error than stored (err_norm)", missing, SELF_TEST_TOLERANCE),
        Finding("own answers, more energy than stored (share)", dearer, ENERGY_TOLERANCE),
    ]


def _onnx_findings(runtime: Runtime, alive: list[int]) -> list[Finding]:
    """Whether the two ONNX files answer as numpy does."""
    questions = ("network.onnx against numpy", "surrogate.onnx against numpy (err_norm)")
    try:
        network = OnnxNetwork(runtime.bundle.files[NETWORK])
        surrogate = OnnxSession(runtime.bundle.files[SURROGATE])
    except DataError as error:
        if "not installed" not in str(error):
            raise
        why = "onnxruntime is not installed"
        return [Finding(f"{question} ({why})", np.nan, ONNX_TOLERANCE) for question in questions]
    fins = [runtime.layout.fins[i] for i in alive]
    prepared = runtime.allocator.pipeline.prepare(
        runtime.layout.without(runtime.failed) if runtime.failed else runtime.layout
    )
    normalization, files = runtime.bundle.graph.normalization, runtime.bundle.files
    cases = runtime.bundle.graph.self_test
    scaled = (np.array([case.wrench for case in cases]) - normalization.mean) / normalization.std
    by_numpy = predict(runtime.allocator.pipeline.network, prepared, scaled)
    by_onnx = predict(network, prepared, scaled)
    parts = [np.abs(a - b) for a, b in zip(by_numpy, by_onnx, strict=True)]
    parts[1][..., 2] = np.minimum(parts[1][..., 2], np.abs(2.0 - parts[1][..., 2]))  # an angle: -1 is 1
    command = np.array([[case.command[i] for i in alive] for case in cases], dtype=np.float32)
    _, wrench = surrogate.run(
        command=command,
        position=np.array([fin.position for fin in fins], dtype=np.float32),
        mounting_angle=np.array([fin.mounting_angle for fin in fins], dtype=np.float32),
    )
    truth = prepared.commands.wrench(command.astype(np.float64)) * normalization.std
    findings = [
        Finding(questions[0], max(float(a.max()) for a in parts), ONNX_TOLERANCE),
        Finding(questions[1], float(normalization.error(wrench, truth).max()), ONNX_TOLERANCE),
    ]
    fast = runtime.bundle.weights.fast
    if fast is not None:
        x = fin_frame_features(prepared.geometry, scaled).astype(np.float32)
        apart = np.abs(OnnxSession(files[FAST]).run(features=x)[0] - NumpyFastNetwork(fast)(x))
        findings.append(Finding("fast.onnx against numpy", float(apart.max()), ONNX_TOLERANCE))
    return findings


def _worst(values: Iterator[float]) -> float:
    """The largest value, not below 0."""
    return max(0.0, *values)
