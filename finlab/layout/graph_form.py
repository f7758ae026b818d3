"""The parts of a layout graph file, version 2, as types, of which `graph.schema.json` is made."""

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, defstruct

from finlab.layout.checked import Name
from finlab.layout.file import BODY, INTERACTION, LIMITS, SERVO, Frame
from finlab.layout.fin import Coordinate, Model, MountingAngle
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


NODE: Any = defstruct(
    "Node",
    [
        ("name", Name),
        ("position", tuple[Coordinate, Coordinate, Coordinate]),
        ("mounting_angle", MountingAngle),
        ("limits", LIMITS),
        ("model", Model),
        ("healthy", bool),
        ("servo", SERVO | None, None),
    ],
    rename={"name": "id", "position": "position_m", "mounting_angle": "mounting_angle_rad"},
    forbid_unknown_fields=True,
    namespace={"__doc__": "A fin: a node of the graph."},
)


class Edge(Struct, forbid_unknown_fields=True):
    """A pair of fins that work, or one such fin twice."""

    source: Name
    target: Name


class NodeLink(Struct, forbid_unknown_fields=True):
    """Node-link form; `networkx.node_link_graph` reads it.

    Edges are all pairs of healthy fins, and each with itself.
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
    """A target [N, N m], a command per fin [rad, Hz, rad] (null for a failed one), and its wrench."""

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
    """A robot's fins, which pairs of them work together, and what is needed to check an answer. SI, radians.

    `checksum` is the SHA-256 of all else, as JSON with sorted keys, without white space, in UTF-8.
    """

    format: Literal["finlab-graph"]
    version: Literal[2]
    checksum: str
    frame: Frame
    units: Units
    layout: About
    graph: NodeLink
    normalization: Statistics
    checkpoint: Checkpoint
    self_test: SelfTests
