"""Reading a bundle that may come from a stranger: bounded, checked before it is believed, never unpacked.

Checksums come first. Then each file is read strictly, and an ONNX file is accepted only if it is, byte for
byte, what finlab writes for the weights in it: whatever runs the file can only run our networks.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finlab.deploy import metadata
from finlab.deploy.bundle import CHECKSUMS, FAST, GRAPH, NETWORK, SURROGATE, checksums
from finlab.deploy.bundle_source import files_at
from finlab.deploy.graph import LayoutGraph
from finlab.deploy.graph_file import parse_graph
from finlab.deploy.onnx.fast import fast_model, fast_weights
from finlab.deploy.onnx.model import Model, model_bytes
from finlab.deploy.onnx.network import network_model, network_weights
from finlab.deploy.onnx.reading import read_model
from finlab.deploy.onnx.surrogate import surrogate_model, surrogate_weights
from finlab.errors import DataError
from finlab.inference.fast_weights import FastWeights
from finlab.inference.weights import NetworkConfig, SurrogateConfig, TrainedWeights
from finlab.layout import FinModelSpec

REQUIRED = (GRAPH, NETWORK, SURROGATE, CHECKSUMS)


@dataclass(frozen=True)
class RobotBundle:
    """What a robot needs, read and checked."""

    graph: LayoutGraph
    """The robot, and self-tests."""
    weights: TrainedWeights
    """The trained networks as arrays."""
    settings: Mapping[str, Any]
    """What the allocator is made with: fields of the pipeline's `Settings`, and `energy_weights`."""
    files: Mapping[str, bytes]
    """The files as they are."""


def read_bundle(path: str | os.PathLike[str]) -> RobotBundle:
    """Read a bundle from its folder or zip archive.

    Raises:
        FinlabError: it cannot be read, was changed after it was written, or is not what finlab writes.
    """
    return parse_bundle(files_at(path), str(path))


def parse_bundle(files: Mapping[str, bytes], source: str = "bundle") -> RobotBundle:
    """A bundle from the contents of its files; errors as in `read_bundle`."""
    for name in REQUIRED:
        if name not in files:
            raise DataError(f"{source}: {name} is missing; a bundle is made by `finlab export LAYOUT -o DIR`")
    _check_sums(files, source)
    try:
        text = files[GRAPH].decode()
    except UnicodeDecodeError:
        raise DataError(f"{source}: {GRAPH} is not UTF-8 text") from None
    graph = parse_graph(text, f"{source}: {GRAPH}")
    names = [name for name in (NETWORK, SURROGATE, FAST) if name in files]
    models = {name: read_model(files[name], f"{source}: {name}") for name in names}
    weights = _weights(models[NETWORK], models[SURROGATE], files, source)
    if FAST in models:
        weights = replace(weights, fast=_fast(models[FAST], files[FAST], f"{source}: {FAST}"))
    _check_kinship(graph, models, source)
    settings = metadata.settings_of(models[NETWORK], f"{source}: {NETWORK}")
    return RobotBundle(graph, weights, settings, dict(files))


def _weights(network: Model, surrogate: Model, files: Mapping[str, bytes], source: str) -> TrainedWeights:
    """The arrays in two models, each of which must be exactly what finlab writes for them."""
    place = f"{source}: {NETWORK}"
    metadata.check_format(network, metadata.NETWORK_FORMAT, place)
    heads = metadata.whole_of(network, "heads", 64, place)
    n_components = metadata.whole_of(network, "n_components", 256, place)
    state = network_weights(network)
    _check_same(lambda: network_model(state, heads, n_components, network.metadata), files[NETWORK], place)
    place = f"{source}: {SURROGATE}"
    metadata.check_format(surrogate, metadata.SURROGATE_FORMAT, place)
    amplitude, frequency = metadata.numbers_of(surrogate, "reference", 2, place)
    (unit,) = metadata.numbers_of(surrogate, "force_unit_n", 1, place)
    if amplitude <= 0 or frequency <= 0 or unit <= 0:
        raise DataError(f"{place}: reference and force_unit_n must be above 0")
    physics = surrogate_weights(surrogate)
    _check_same(
        lambda: surrogate_model(physics, (amplitude, frequency), unit, surrogate.metadata),
        files[SURROGATE],
        place,
    )
    fin_model = metadata.value_of(surrogate, "fin_model", place)
    if not isinstance(fin_model, dict) or "type" not in fin_model:
        raise DataError(f"{place}: fin_model must name a fin model, got {fin_model!r:.40}")
    FinModelSpec.from_values(fin_model)
    return TrainedWeights(
        name=network.metadata.get("checkpoint", ""),
        normalization=metadata.normalization_of(network, f"{source}: {NETWORK}"),
        fin_model=fin_model,
        surrogate_config=SurrogateConfig(),
        surrogate=physics,
        network_config=NetworkConfig(heads=heads, n_components=n_components),
        network=state,
    )


def _fast(model: Model, content: bytes, place: str) -> FastWeights:
    metadata.check_format(model, metadata.FAST_FORMAT, place)
    weights = fast_weights(model)
    _check_same(lambda: fast_model(weights, model.metadata), content, place)
    return weights


def _check_same(make: Callable[[], Model], content: bytes, place: str) -> None:
    """Refuse a file that is not what finlab writes for the weights that were found in it."""
    try:
        same = model_bytes(make()) == content
    except (KeyError, ValueError, IndexError, TypeError, AttributeError, OverflowError):
        same = False
    if not same:
        raise DataError(f"{place}: is not what this finlab writes for such weights; export it again")


def _check_kinship(graph: LayoutGraph, models: Mapping[str, Model], source: str) -> None:
    """Refuse parts that come from different exports."""
    for name, model in models.items():
        if model.metadata.get("checkpoint_sha256") != graph.checkpoint_sha256:
            raise DataError(f"{source}: {name} and {GRAPH} are of different checkpoints; export again")
        statistics = metadata.normalization_of(model, f"{source}: {name}")
        if not all(np.array_equal(a, b) for a, b in zip(statistics, graph.normalization, strict=True)):
            raise DataError(f"{source}: {name} and {GRAPH} differ in normalization; export again")


def _check_sums(files: Mapping[str, bytes], source: str) -> None:
    rest = {name: content for name, content in files.items() if name != CHECKSUMS}
    if checksums(rest) == files[CHECKSUMS]:
        return
    listed = {line[66:]: line[:64] for line in files[CHECKSUMS].decode("utf-8", "replace").splitlines()}
    actual = {line[66:]: line[:64] for line in checksums(rest).decode().splitlines()}
    wrong = next((name for name in actual if listed.get(name) != actual[name]), CHECKSUMS)
    raise DataError(f"{source}: {wrong} does not fit {CHECKSUMS}; it was changed; copy the bundle again")
