"""Command to force to wrench: fin models, the plant, energy."""

from importlib import import_module
from typing import Any

_HOME = {
    "Drag": "drag",
    "FinModel": "fin_model",
    "make_fin_model": "fin_model",
    "Lighthill": "lighthill",
    "Plant": "plant",
    "TableFinModel": "table",
    "write_table": "table",
    "assemble_wrench": "wrench",
    "body_force": "wrench",
    "effectiveness_matrix": "wrench",
    "wrench_of_forces": "wrench",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(name)
    return getattr(import_module(f"finlab.physics.{_HOME[name]}"), name)
