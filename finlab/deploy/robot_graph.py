"""The layout graph file: a robot as the complete graph that the networks see.

`networkx.node_link_graph` opens it. Features of a fin with a horizontal shaft are the paper's ten
(x_i in R^10: position, mounting angle, limits); those of other actuators have two of their own axes
in place of the angle. `finlab.layout.graph_file` reads the file.
"""

import json
import os
from pathlib import Path

from msgspec import to_builtins

from finlab.arrays import Array
from finlab.assets import checkpoint_path
from finlab.axes import AXES
from finlab.errors import LayoutError
from finlab.files.checkpoint_config import read_normalization
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.graph_file import (
    COMMAND_SCALES,
    POSITION_SCALE,
    Edge,
    Graph,
    GraphAttributes,
    Normalization,
    PaperNormalization,
    edges_of,
)
from finlab.layout.load import FORMAT as LAYOUT_FORMAT
from finlab.layout.save import layout_to_dict, plain
from finlab.physics.objective import wrench_scale_of
from finlab.whole_file import write_whole


def features_of(actuator: Actuator) -> dict[str, float]:
    """Returns the features of an actuator by name and unit."""
    x, y, z = actuator.position
    features = {"x [m]": x, "y [m]": y, "z [m]": z}
    angle = actuator.value("mounting_angle")
    if angle is not None:
        features["alpha [rad]"] = angle
    else:
        for name, axis in zip(("first axis", "second axis"), actuator.frame, strict=False):
            for letter, value in zip("xyz", axis, strict=True):
                features[f"{name} {letter}"] = float(value)
    for number, low, high in zip(
        actuator.KIND.numbers, actuator.lower, actuator.upper, strict=False
    ):
        features[f"{number.name}_min [{number.unit}]"] = float(low)
        features[f"{number.name}_max [{number.unit}]"] = float(high)
    return features


def graph_of(layout: Layout) -> Graph:
    """Returns a robot as a graph; force tables stay in their files, named by their paths."""
    head = layout_to_dict(layout)
    for key in ("fins", "actuators"):
        head.pop(key, None)
    nodes = []
    for record, actuator in zip(plain(layout.actuators), layout.actuators, strict=True):
        name = record.pop("name")
        nodes.append({"id": name, **record, "features": features_of(actuator)})
    # Scales of a fin's ten features: position, mounting angle, then both limits of each number.
    scales = [POSITION_SCALE] * 3 + [COMMAND_SCALES[2]]
    for scale in COMMAND_SCALES:
        scales += [scale, scale]
    names = features_of(Fin("fin", (0.0, 0.0, 0.0), 0.0))
    wrench = by_axis(wrench_scale_of(layout))
    learned = read_normalization(checkpoint_path("paper"))
    paper = PaperNormalization(mean=by_axis(learned.mean), std=by_axis(learned.std))
    return Graph(
        directed=False,
        multigraph=False,
        graph=GraphAttributes(
            layout={**head, "format": LAYOUT_FORMAT, "version": 2},
            normalization=Normalization(dict(zip(names, scales, strict=True)), wrench, paper),
        ),
        nodes=nodes,
        edges=[Edge(*pair) for pair in edges_of(list(layout.names))],
    )


def by_axis(values: Array) -> dict[str, float]:
    """Returns the numbers of a wrench (6,) by the names of its axes."""
    return dict(zip(AXES, values.tolist(), strict=True))


def graph_text(layout: Layout) -> str:
    """Returns the text of a robot's graph file; the same robot gives the same text."""
    graph = to_builtins(graph_of(layout))
    return json.dumps(graph, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def write_graph(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a graph file; an existing file is replaced whole.

    Args:
        layout: the robot.
        path: the file.

    Raises:
        LayoutError: the name does not end in `.json`, or the file cannot be written.
    """
    if Path(path).suffix.lower() != ".json":
        raise LayoutError("expected the name of a file that ends in .json", source=str(path))
    write_whole(path, graph_text(layout))
