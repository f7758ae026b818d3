"""The robot in a bundle, `robot.json`: its layout as a layout file has it, what it has lost, self-tests."""

import json
import os
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct, to_builtins

from finlab.bundle_files import ROBOT, TABLES, Files
from finlab.errors import LayoutError
from finlab.files.guarded import decoded
from finlab.files.plain_values import parse_json
from finlab.files.schema import checked
from finlab.layout.checked import Name
from finlab.layout.file import layout_to_dict, parse_layout
from finlab.layout.file_form import under
from finlab.layout.layout import Layout

Wrench = tuple[float, float, float, float, float, float]


class Case(Struct, frozen=True, forbid_unknown_fields=True):
    """A target [N, N m], a command per actuator in SI and radians (null for a failed one), and its wrench."""

    wrench: Wrench
    command: tuple[tuple[float, float, float] | None, ...]
    delivered_wrench: Wrench


class Robot(Struct, forbid_unknown_fields=True):
    """What a bundle holds beside the method's settings."""

    layout: Any
    """The `Layout`, failed actuators included; in the file as a layout file has it."""
    failed: tuple[Name, ...]
    """Actuators that do not work."""
    weights_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")] | None
    """SHA-256 of the weights of the method's networks, hexadecimal; None for methods without."""
    self_test: tuple[Case, ...]
    """Targets with their answers."""


def robot_bytes(robot: Robot) -> bytes:
    """Returns the contents of the file."""
    values = {**to_builtins(robot, builtin_types=(Layout,)), "layout": layout_to_dict(robot.layout)}
    return (json.dumps(values, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def robot_of(files: Files, source: str) -> Robot:
    """Returns the robot among the files of a bundle, a folder or archive at the path `source`.

    Raises:
        LayoutError: it holds no layout, or one that names a force table outside the bundle.
    """
    place, folder = f"{source}/{ROBOT}", Path(os.path.abspath(source))
    values = parse_json(decoded(files[ROBOT], place, "JSON", LayoutError), place, LayoutError)
    robot = checked(values, Robot, source=place)
    layout: Layout = parse_layout(robot.layout, f"{place}: layout", folder, may_open=False)
    tables = {str(folder / name) for name in files if name.startswith(TABLES)}
    with under(source=place):
        layout.indices(robot.failed)
        for fin in layout.fins:
            if fin.model.values().get("path", "") not in {"", *tables}:
                problem = "names a force table that is not in the bundle; export it again"
                raise LayoutError(problem, f"layout, fin {fin.name!r}, model.path")
        for i, case in enumerate(robot.self_test):
            if len(case.command) != layout.n:
                problem = f"expected {layout.n} rows, one for each actuator, got {len(case.command)}"
                raise LayoutError(problem, f"self_test[{i}].command")
    robot.layout = layout
    return robot
