"""Converts between layout files and the formats of others: `finlab layout convert`.

`read_any` recognizes a format by a file's suffix and content and hands its text to the reader of
that format; `WRITERS` has the writers. The app reads dropped files by `read_robot`.
"""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from finlab.assets import shipped_layouts
from finlab.errors import CommandError, LayoutError, layout_errors_at
from finlab.exchange import motor_factors
from finlab.exchange.description_layout import read_description
from finlab.exchange.description_text import SDF, URDF, description_text
from finlab.exchange.exchange import Exchange
from finlab.exchange.matrix_table import plain_of, table_of
from finlab.exchange.mjcf_read import read_mjcf
from finlab.exchange.mjcf_write import write_mjcf
from finlab.exchange.parameters import read_parameters, read_px4, write_px4
from finlab.exchange.plain_robot import read_plain, write_matrix
from finlab.exchange.stonefish import is_stonefish, read_stonefish
from finlab.exchange.xml_models import root_of
from finlab.files import parse_json, parse_toml, parse_yaml, without_comments
from finlab.files.guarded import is_regular, read_text
from finlab.layout import Layout, load_layout, save_layout
from finlab.layout.load import parse_layout
from finlab.whole_file import write_whole

MAX_BYTES = 5_000_000
"""Largest file that is read [bytes]; meshes are files of their own and are not opened."""
WRITERS: dict[str, Callable[[Layout, Exchange, str], str]] = {
    "urdf": lambda layout, exchange, _: description_text(layout, exchange, URDF),
    "sdf": lambda layout, exchange, _: description_text(layout, exchange, SDF),
    "mjcf": write_mjcf,
    "px4": write_px4,
    "ardusub": motor_factors.write_ardusub,
    "matrix": write_matrix,
}
"""Writers of all formats but layout files, by the name that `--to` takes. Arguments: the layout,
the exchange that gets the notes, and the suffix of the file; returns its text."""
FORMAT_OF_SUFFIX = {
    ".urdf": "urdf",
    ".sdf": "sdf",
    ".xml": "mjcf",
    ".mjcf": "mjcf",
    ".params": "px4",
    ".cpp": "ardusub",
    ".csv": "matrix",
    ".yaml": "layout",
    ".yml": "layout",
    ".json": "layout",
}
"""The format that is written for a suffix where the user names none."""
TABLES = (".csv", ".tsv", ".txt", ".dat")
"""Suffixes of files with delimited cells."""
PROGRAMS = (".cpp", ".h", ".hpp", ".lua")
"""Suffixes of sources with calls that add motors to ArduSub."""
PARAMETERS = (".params", ".parm", ".param")
"""Suffixes of parameter files of PX4 and ArduPilot."""
FOREIGN = (
    ".urdf",
    ".sdf",
    ".world",
    ".xacro",
    ".xml",
    ".mjcf",
    ".scn",
    ".toml",
    *PARAMETERS,
    *PROGRAMS,
)
"""Suffixes of robot descriptions, and of what autopilots read; their content says what they
hold."""
_TOML_TABLE = re.compile(r"\[\[?[\w.\"' -]{1,100}\]\]?[ \t]*(?:\n|$)")
"""The head of a table of TOML."""
_TOML_KEY = re.compile(r"[\w.-]{1,100}[ \t]*=[ \t]*\S")
"""The key of a value of TOML."""
UNKNOWN_FORMAT = (
    "holds none of the forms that are read: a layout, a robot description (URDF, SDF, MJCF), "
    "parameters of PX4 or ArduSub, motors of ArduSub, thrusters or a matrix in YAML, JSON, TOML or "
    "CSV"
)


def convert(
    file: str, output: str | os.PathLike[str], to: str | None, exchange: Exchange
) -> tuple[Layout, list[str]]:
    """Converts one file into another format.

    Args:
        file: a file of any format that is read, a bundle, or the name of a shipped layout.
        output: the file to write.
        to: `layout`, or a key of `WRITERS`; by the suffix of the output when None.
        exchange: defaults for what the file does not say; gets the notes.

    Returns:
        The layout that was converted, and the exchange's notes.

    Raises:
        FinlabError: a file cannot be read or written, or the suffix of the output names no format.
    """
    suffix = Path(output).suffix.lower()
    form = to or FORMAT_OF_SUFFIX.get(suffix)
    if form is None:
        raise CommandError(
            f"{output}: its end says no form; say --to {', '.join(['layout', *WRITERS])}"
        )
    layout = read_any(file, exchange)
    if form == "layout":
        save_layout(layout, output)
    else:
        write_whole(output, text_in(form, layout, exchange, suffix))
    return layout, exchange.notes


def text_in(form: str, layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns a layout in a format of others, as text.

    Args:
        form: a key of `WRITERS`.
        layout: the layout to write.
        exchange: gets the notes on what the format cannot hold.
        suffix: of the file, such as `.csv`; some formats have several forms.

    Raises:
        LayoutError: the format cannot hold the layout.
    """
    for actuator in layout.actuators:
        if not actuator.KIND.described:
            raise LayoutError(
                f"{form} has no place for a {actuator.type}; write a layout file, or finlab export "
                "for a program",
                actuator=f"{actuator.type} {actuator.name!r:.66}",
            )
    if layout.interaction is not None:
        exchange.note(
            f"What the actuators do to each other is left out: {form} has no place for it."
        )
    return WRITERS[form](layout, exchange, suffix)


def read_any(file: str, exchange: Exchange) -> Layout:
    """Returns the layout in a file of any format.

    Args:
        file: the path, or the name of a shipped layout.
        exchange: defaults for what the file does not say; gets the notes.

    Raises:
        FinlabError: the file cannot be read, or its format is not recognized.
    """
    path = Path(file)
    if file in shipped_layouts() or not is_regular(path) or path.suffix.lower() == ".zip":
        return load_layout(file)
    text = read_text(
        path, MAX_BYTES, "a robot description, parameters, a matrix or a layout", LayoutError
    )
    exchange.path = path.resolve()
    with layout_errors_at(source=file):
        return read_robot(text, path.name, exchange)


def read_robot(text: str, file: str, exchange: Exchange) -> Layout:
    """Returns the layout in a text of any format.

    Args:
        text: the content of the file.
        file: the name of the file; its suffix helps to recognize the format, and its stem names
            the robot where the text does not.
        exchange: defaults for what the file does not say; gets the notes.

    Raises:
        LayoutError: a value is wrong or missing, or the format is not recognized.
    """
    path = Path(file)
    name = path.stem.strip()[:64].strip() or "robot"
    suffix = path.suffix.lower()
    if text.lstrip().startswith("<"):
        return _read_xml(text, name, exchange)
    if FORMAT_OF_SUFFIX.get(suffix) != "layout":
        layout = _read_lines(text, name, suffix, exchange)
        if layout is not None:
            return layout
    data = _plain_values(text, suffix)
    if isinstance(data, dict) and _is_layout_file(data):
        folder = exchange.path.parent if exchange.path else None
        layout = parse_layout(data, "", folder, may_open=folder is not None)
        _note_parts(layout, data["actuators"], exchange)
        return layout
    if not isinstance(data, dict | list):
        raise LayoutError(UNKNOWN_FORMAT)
    comments = [line for line in text.splitlines() if line.lstrip().startswith(("#", "//"))]
    return read_plain(data, name, exchange, comments)


def _note_parts(layout: Layout, listed: Sequence[Mapping[str, Any]], exchange: Exchange) -> None:
    """Says what a layout file lists as an actuator and was read as a part of another one.

    Args:
        layout: the robot.
        listed: the actuators as the file has them.
        exchange: gets the notes.
    """
    names = {actuator["name"] for actuator in listed}
    for actuator in layout.actuators:
        if names.intersection(actuator.parts):
            exchange.note(
                actuator.parts_words,
                "alone: true of the rudder keeps two actuators",
                field="slipstream",
                actuators=[actuator.name],
            )


def _plain_values(text: str, suffix: str) -> Any:
    """The values in a text of JSON, perhaps with comments, TOML or YAML."""
    if suffix == ".json":
        try:
            return parse_json(text, "", LayoutError)
        except LayoutError:
            bare = without_comments(text)
            if bare == text:
                raise
            return parse_json(bare, "", LayoutError)
    if suffix == ".toml":
        return parse_toml(text, "", LayoutError)
    if FORMAT_OF_SUFFIX.get(suffix) != "layout":
        bare = without_comments(text)
        start = bare.lstrip()
        if _TOML_TABLE.match(start) or _TOML_KEY.match(start):
            try:
                return parse_toml(text, "", LayoutError)
            except LayoutError as error:
                raise LayoutError(f"{UNKNOWN_FORMAT}; as TOML it {error.problem}") from None
        if start[:1] in ("{", "["):
            return parse_json(bare, "", LayoutError)
    return parse_yaml(text, "", LayoutError)


def _read_xml(text: str, name: str, exchange: Exchange) -> Layout:
    """The layout in a text of XML; its outermost element says what it is."""
    root = root_of(text)
    if root.tag in ("mujoco", "mujocoinclude"):
        return read_mjcf(root, name, exchange)
    if is_stonefish(root):
        return read_stonefish(root, name, exchange)
    return read_description(root, name, exchange)


def _is_layout_file(data: dict[str, Any]) -> bool:
    """Whether a mapping is a layout of finlab: by its head, or by actuators that have a type."""
    if "format" in data or "fins" in data:
        return True
    actuators = data.get("actuators")
    if not isinstance(actuators, list):
        return False
    return any(isinstance(actuator, dict) and "type" in actuator for actuator in actuators)


def _read_lines(text: str, name: str, suffix: str, exchange: Exchange) -> Layout | None:
    """The layout in lines of parameters, motors or cells; None where the text is none of these.

    Parameters and motors are recognized by their content under any suffix, tables by the suffix.
    """
    if "CA_ROTOR" in text:
        return read_px4(text, name, exchange)
    if "add_motor" in text:
        return motor_factors.layout_of_motors(name, motor_factors.motors_in_source(text), exchange)
    if motor_factors.ARDUPILOT_PARAMETER.search(text):
        return motor_factors.read_parameters_of_ardusub(text, name, exchange)
    if suffix in TABLES:
        table = table_of(text)
        if table.has_motor_factors:
            motors = motor_factors.motors_in_table(table)
            return motor_factors.layout_of_motors(name, motors, exchange)
        return read_plain(plain_of(table), name, exchange, table.comments, table=True)
    if suffix in PARAMETERS:
        n_parameters = len(read_parameters(text, ""))
        if n_parameters > 0:
            names = (
                "neither CA_ROTOR_COUNT (PX4) nor FRAME_CONFIG (ArduSub), by which they name "
                "thrusters"
            )
            raise LayoutError(f"holds {n_parameters} parameters of an autopilot, but {names}")
    if suffix in PROGRAMS:
        raise LayoutError(
            "is a program without a call of add_motor_raw_6dof, by which ArduSub adds motors, or "
            "of Motors_6DoF:add_motor"
        )
    return None
