"""A layout graph as the JSON object that stands in its file."""

from __future__ import annotations

from typing import Any

from finlab.deploy.graph import SELF_TEST_TOLERANCE, LayoutGraph, Row
from finlab.layout import layout_to_dict
from finlab.layout.file import FRAME
from finlab.layout.load import FORMAT, UNITS, VERSION


def document_of(graph: LayoutGraph) -> dict[str, Any]:
    """Everything but the checksum, which comes third once it is known."""
    layout = layout_to_dict(graph.layout)
    nodes = []
    for fin, entry, features in zip(graph.layout.fins, layout["fins"], graph.features, strict=True):
        node = {
            "id": entry["name"],
            "position_m": entry["position_m"],
            "mounting_angle_rad": fin.mounting_angle,
        }
        node |= {"limits": entry["limits"], "model": entry["model"]}
        nodes.append(node | {"healthy": fin.name not in graph.failed, "features": _plain(features)})
    return {
        "format": FORMAT,
        "version": VERSION,
        "checksum": "",
        "frame": FRAME,
        "units": UNITS,
        "layout": {key: layout[key] for key in ("name", "description", "body") if key in layout},
        "graph": {
            "directed": False,
            "multigraph": False,
            "graph": {"name": graph.layout.name},
            "nodes": nodes,
            "edges": edges_of(graph),
        },
        "features": {"set": graph.feature_set},
        "normalization": {"mean": graph.normalization.mean.tolist(), "std": graph.normalization.std.tolist()},
        "checkpoint": {"name": graph.checkpoint, "sha256": graph.checkpoint_sha256},
        "self_test": {
            "tolerance_err_norm": SELF_TEST_TOLERANCE,
            "cases": [
                {
                    "wrench": list(case.wrench),
                    "command": [_plain(row) for row in case.command],
                    "predicted_wrench": list(case.predicted_wrench),
                    "features": [_plain(row) for row in case.features],
                }
                for case in graph.self_test
            ],
        },
    }


def edges_of(graph: LayoutGraph) -> list[dict[str, str]]:
    """Every pair of healthy fins, and each with itself."""
    return [{"source": a, "target": b} for a, b in graph.edges]


def _plain(row: Row | None) -> list[float] | None:
    return None if row is None else list(row)
