"""The layout graph file: a robot as the complete graph that the networks see.

`networkx.node_link_graph` opens it, `finlab.load_layout` reads the robot back. Features of a fin with a
horizontal shaft are the paper's ten (x_i in R^10: position, mounting angle, limits); those of other actuators
have two of their own axes in place of the angle.
"""

import json
import os
from pathlib import Path

from msgspec import to_builtins

from finlab.errors import LayoutError
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.axes import AXES
from finlab.layout.file import FORMAT, layout_to_dict
from finlab.layout.file_form import plain
from finlab.layout.load import Data, Edge, Graph, Normalization, edges_of
from finlab.paper.network import POSITION_SCALE, SCALES
from finlab.physics.objective import yardstick
from finlab.whole_file import write_whole

_FORCE = ("force", "N")
_ANGLE = ("angle", "rad")
COMMANDS = {
    "fin": (("A", "rad"), ("f", "Hz"), ("phi", "rad")),
    "thruster": (_FORCE,),
    "azimuth": (_ANGLE, _FORCE),
    "tilt": (_ANGLE, _FORCE),
    "rudder": (("deflection", "rad"),),
}
"""Numbers of a command and their units, by type of actuator."""


def features_of(part: Actuator) -> dict[str, float]:
    """Returns the features of an actuator by name and unit."""
    found = dict(zip(("x [m]", "y [m]", "z [m]"), part.position, strict=True))
    if isinstance(part, Fin) and part.mounting_angle is not None:
        found["alpha [rad]"] = part.mounting_angle
    else:
        for name, axis in zip(("first axis", "second axis"), part.frame, strict=False):
            found |= {f"{name} {one}": float(value) for one, value in zip("xyz", axis, strict=True)}
    for (name, unit), low, high in zip(COMMANDS[part.type], part.lower, part.upper, strict=False):
        found |= {f"{name}_min [{unit}]": float(low), f"{name}_max [{unit}]": float(high)}
    return found


def graph_of(layout: Layout) -> Graph:
    """Returns a robot as a graph; tables of fins' forces that it names are kept by their paths."""
    about = {key: value for key, value in layout_to_dict(layout).items() if key not in ("fins", "actuators")}
    parts = plain(layout.actuators)
    nodes = [
        {"id": part.pop("name"), **part, "features": features_of(own)}
        for part, own in zip(parts, layout.actuators, strict=True)
    ]
    scales = [POSITION_SCALE] * 3 + [SCALES[2]] + [scale for scale in SCALES for _ in range(2)]
    names = features_of(Fin("fin", (0.0, 0.0, 0.0), 0.0))
    wrench = dict(zip(AXES, yardstick(layout).tolist(), strict=True))
    return Graph(
        directed=False,
        multigraph=False,
        graph=Data(
            layout={**about, "format": FORMAT, "version": 2},
            normalization=Normalization(dict(zip(names, scales, strict=True)), wrench),
        ),
        nodes=nodes,
        edges=[Edge(*pair) for pair in edges_of(list(layout.names))],
    )


def graph_text(layout: Layout) -> str:
    """Returns the text of a robot's graph file; the same robot gives the same text."""
    return json.dumps(to_builtins(graph_of(layout)), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def write_graph(layout: Layout, path: str | os.PathLike[str]) -> None:
    """Writes a graph file; an existing file is replaced whole. LayoutError: the name does not end in
    `.json`, or the file cannot be written."""
    if Path(path).suffix.lower() != ".json":
        raise LayoutError("expected the name of a file that ends in .json", source=str(path))
    write_whole(path, graph_text(layout))
