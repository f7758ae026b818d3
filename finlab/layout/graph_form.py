"""The parts of a layout graph file, version 3, as types, of which `graph.schema.json` is made."""

from pathlib import Path
from typing import Annotated, Any, Literal, Union

from msgspec import Meta, Struct

from finlab.layout.actuator import Actuator
from finlab.layout.actuator_form import OTHERS, actuator_of, actuator_to_dict, form_of
from finlab.layout.checked import Name, form
from finlab.layout.file import BODY, INTERACTION, LIMITS, SERVO, Frame, fin_of, fin_to_dict
from finlab.layout.fin import Fin, Model
from finlab.layout.layout import MAX_ACTUATORS, MAX_DESCRIPTION_LENGTH

Wrench = tuple[float, float, float, float, float, float]
Deviation = Annotated[float, Meta(ge=0.0, le=1e9)]
Digest = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]


class Units(Struct, forbid_unknown_fields=True):
    """The only units there are."""

    length: Literal["m"] = "m"
    angle: Literal["rad"] = "rad"
    frequency: Literal["Hz"] = "Hz"
    force: Literal["N"] = "N"
    torque: Literal["N m"] = "N m"


FIN = form(
    Fin,
    {"name": "id", "position": "position_m", "mounting_angle": "mounting_angle_rad"},
    called="FinNode",
    required=["limits", "model"],
    limits=LIMITS,
    model=Model,
    servo=SERVO,
    healthy=bool,
)
NODE: Any = Union[FIN, *(form_of(kind, True, healthy=bool) for kind in OTHERS)]  # noqa: UP007
"""An actuator, a node of the graph: what a layout file says of it, in radians, and whether it works."""


def actuator_of_node(node: Any, folder: Path | None) -> Actuator:
    """Returns the actuator in a node; relative paths start at a folder."""
    if isinstance(node, FIN):
        return fin_of(node, node.mounting_angle, folder)
    return actuator_of(node, folder, radians=True, may_open=False)


def node_to_dict(actuator: Actuator, healthy: bool) -> dict[str, Any]:
    """Returns the plain values of a node; `actuator_of_node` gives the same actuator back."""
    if not isinstance(actuator, Fin):
        return {**actuator_to_dict(actuator, radians=True), "healthy": healthy}
    told = fin_to_dict(actuator)
    if told.pop("mounting_angle_deg", None) is not None:
        told["mounting_angle_rad"] = actuator.mounting_angle
    return {"id": told.pop("name"), "type": actuator.type, **told, "healthy": healthy}


class Edge(Struct, forbid_unknown_fields=True):
    """A pair of actuators that work, or one such actuator twice."""

    source: Name
    target: Name


class NodeLink(Struct, forbid_unknown_fields=True):
    """Node-link form; `networkx.node_link_graph` reads it.

    Edges are all pairs of healthy actuators, and each with itself.
    """

    directed: bool
    multigraph: bool
    graph: dict[str, str]
    nodes: Annotated[list[NODE], Meta(min_length=1, max_length=MAX_ACTUATORS)]
    edges: list[Edge]

    def __post_init__(self) -> None:
        if self.directed or self.multigraph:
            raise ValueError("expected directed and multigraph to be false")


class Statistics(Struct, forbid_unknown_fields=True):
    """Mean and standard deviation of the wrench per axis; errors are measured in `std`."""

    mean: Wrench
    std: tuple[Deviation, Deviation, Deviation, Deviation, Deviation, Deviation]


class Checkpoint(Struct, forbid_unknown_fields=True):
    """Where the networks come from; nulls for a method without networks."""

    name: Annotated[str, Meta(min_length=1, max_length=200)] | None
    sha256: Digest | None


class Case(Struct, forbid_unknown_fields=True):
    """A target [N, N m], a command per actuator in SI and radians (null for a failed one), and its wrench."""

    wrench: Wrench
    command: tuple[tuple[float, float, float] | None, ...]
    delivered_wrench: Wrench


class SelfTests(Struct, forbid_unknown_fields=True):
    """Answers to compare with, and how far another may be from them."""

    method: Annotated[str, Meta(min_length=1, max_length=40)]
    tolerance_err_norm: Annotated[float, Meta(gt=0.0)]
    cases: list[Case]


class About(Struct, forbid_unknown_fields=True):
    """The layout's other parts, as in a layout file."""

    name: Name
    description: Annotated[str, Meta(max_length=MAX_DESCRIPTION_LENGTH)] | None = None
    body: BODY | None = None
    interaction: INTERACTION | None = None


class Graph(Struct, forbid_unknown_fields=True):
    """A robot's actuators, which pairs of them work together, and what is needed to check an answer.

    `checksum` is the SHA-256 of all else, as JSON with sorted keys, without white space, in UTF-8.
    """

    format: Literal["finlab-graph"]
    version: Literal[3]
    checksum: str
    frame: Frame
    units: Units
    layout: About
    graph: NodeLink
    normalization: Statistics
    checkpoint: Checkpoint
    self_test: SelfTests
