"""The one interface of all fin models, and how a model is made from its description."""

from collections.abc import Callable
from typing import Any, Protocol

from torch import Tensor

from finlab.layout.fin_model import FinModelSpec
from finlab.physics.drag import Drag
from finlab.physics.lighthill import Lighthill


class FinModel(Protocol):
    """Command to mean force of one fin, batched and differentiable, float32 or float64 as the command is."""

    name: str
    """Type name, as in a layout file."""

    def force(self, command: Tensor) -> Tensor:
        """Returns the mean force (..., 3) [N] in the fin frame of command (..., 3) [rad, Hz, rad]."""
        ...


def make_fin_model(spec: FinModelSpec) -> FinModel:
    """Returns the fin model that `spec` describes.

    Raises:
        DataError: it is a table whose file is missing or wrong.
    """
    return _MAKERS[spec.type](**spec.values())


def _table(path: str) -> FinModel:
    # Imported late because a table can be written from any other model, so it knows this interface.
    from finlab.physics.table import TableFinModel

    return TableFinModel(path)


_MAKERS: dict[str, Callable[..., Any]] = {"drag": Drag, "lighthill": Lighthill, "table": _table}
