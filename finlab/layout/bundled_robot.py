"""The robot in a bundle: its file `robot.json`, with what does not work and a self-test.

`finlab.deploy` writes it and answers with it, `finlab.layout.load` takes its layout.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from finlab.bundle_files import ROBOT_FILE, TABLE_FOLDER, Files
from finlab.errors import LayoutError, layout_errors_at
from finlab.files import parse_json
from finlab.files.guarded import decoded
from finlab.files.schema import Name, checked
from finlab.layout.layout import Layout

Wrench = tuple[float, float, float, float, float, float]
"""A wrench [Fx, Fy, Fz, Tx, Ty, Tz] in a file, body frame [N, N m]."""


class SelfTestCase(Struct, frozen=True, forbid_unknown_fields=True):
    """A target, and what the method answered when the bundle was made; a robot that runs the bundle
    has to answer the same."""

    wrench: Wrench
    """The desired wrench."""
    command: tuple[tuple[float, float, float] | None, ...]
    """A command for each actuator, in SI and radians; null for a lost one."""
    delivered_wrench: Wrench
    """What these commands give by the plant."""


class BundledRobot(Struct, forbid_unknown_fields=True):
    """What a bundle holds beside the method's settings."""

    layout: Any
    """The `Layout`, lost actuators included; in the file as a layout file has it."""
    lost: tuple[Name, ...]
    """Actuators that do not work."""
    weights_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")] | None
    """SHA-256 of the weights of the method's networks, hexadecimal; None for methods without."""
    self_test: tuple[SelfTestCase, ...]
    """Targets with their answers."""


def robot_of(files: Files, source: str, parse: Callable[..., Layout]) -> BundledRobot:
    """Returns the robot among the files of a bundle.

    Args:
        files: the contents by name.
        source: path of the folder or archive.
        parse: `finlab.layout.load.parse_layout`, which reads the layout.

    Raises:
        LayoutError: there is no layout, or one that names a force table or a network outside the
            bundle, or its self-test has commands for another number of actuators.
    """
    robot_source = f"{source}/{ROBOT_FILE}"
    folder = Path(os.path.abspath(source))
    text = decoded(files[ROBOT_FILE], robot_source, "JSON", LayoutError)
    values = parse_json(text, robot_source, LayoutError)
    robot = checked(values, BundledRobot, source=robot_source)
    layout: Layout = parse(robot.layout, f"{robot_source}: layout", folder, may_open=False)
    tables = {str(folder / name) for name in files if name.startswith(TABLE_FOLDER)}
    with layout_errors_at(source=robot_source):
        layout.indices(robot.lost)  # refuses unknown names
        for fin in layout.fins:
            if fin.model.values().get("path", "") not in {"", *tables}:
                problem = "names a force table that is not in the bundle; export it again"
                raise LayoutError(problem, f"layout, fin {fin.name!r}, model.path")
        if layout.interaction is not None and layout.interaction.reads not in {None, *tables}:
            problem = "names a network that is not in the bundle; export it again"
            raise LayoutError(problem, "layout, interaction.path")
        for i, case in enumerate(robot.self_test):
            if len(case.command) != layout.n:
                problem = (
                    f"expected {layout.n} rows, one for each actuator, got {len(case.command)}"
                )
                raise LayoutError(problem, f"self_test[{i}].command")
    robot.layout = layout
    return robot
