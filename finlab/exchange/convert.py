"""Forms of files by their end and content, and one form made into another."""

import os
from collections.abc import Callable
from pathlib import Path

from finlab.assets import shipped_layouts
from finlab.errors import CommandError, LayoutError, under
from finlab.exchange import motor_factors
from finlab.exchange.description_text import SDF, URDF, description_text
from finlab.exchange.exchange import Exchange
from finlab.exchange.gazebo import read_description
from finlab.exchange.matrix_table import plain_of, table_of
from finlab.exchange.parameters import read_parameters, read_px4, write_px4
from finlab.exchange.plain_robot import read_plain, write_matrix
from finlab.files import parse_json, parse_yaml
from finlab.files.guarded import is_regular, read_text
from finlab.layout import Layout, load_layout, save_layout
from finlab.layout.load import parse_layout
from finlab.whole_file import write_whole

MAX_BYTES = 5_000_000
"""Largest file that is read; meshes are files of their own and are not touched."""
WRITERS: dict[str, Callable[[Layout, Exchange, str], str]] = {
    "urdf": lambda layout, exchange, _: description_text(layout, exchange, URDF),
    "sdf": lambda layout, exchange, _: description_text(layout, exchange, SDF),
    "px4": write_px4,
    "ardusub": motor_factors.write_ardusub,
    "matrix": write_matrix,
}
"""Forms beside layout files that are written: the text for a layout and the suffix of the file."""
FORM_OF = {".urdf": "urdf", ".sdf": "sdf", ".params": "px4"}
FORM_OF |= {
    ".cpp": "ardusub",
    ".csv": "matrix",
    ".yaml": "layout",
    ".yml": "layout",
    ".json": "layout",
}
"""What a suffix stands for where the user does not say."""
TABLES = (".csv", ".tsv", ".txt", ".dat")
PROGRAMS = (".cpp", ".h", ".hpp", ".lua")
PARAMETERS = (".params", ".parm", ".param")
FOREIGN = (".urdf", ".sdf", ".world", ".xacro", ".scn", *PARAMETERS, *PROGRAMS)
"""Suffixes of robot descriptions, and of what autopilots read; their content says what they
hold."""
UNKNOWN = (
    "holds none of the forms that are read: a layout, a robot description (URDF, SDF), parameters "
    "of PX4 or ArduSub, motors of ArduSub, thrusters or a matrix in YAML, JSON or CSV"
)


def convert(
    file: str, output: str | os.PathLike[str], to: str | None, exchange: Exchange
) -> tuple[Layout, list[str]]:
    """Makes one file into another, and returns the layout that went through, and the exchange's
    notes.

    `file` is of any form, a bundle, or the name of a shipped layout; `to` is `layout` or one of
    `WRITERS`, by the suffix of the output when None. Raises FinlabError: a file cannot be read or
    written, or the end of the output says no form."""
    suffix = Path(output).suffix.lower()
    form = to or FORM_OF.get(suffix)
    if form is None:
        raise CommandError(
            f"{output}: its end says no form; say --to {', '.join(['layout', *WRITERS])}"
        )
    layout = read_any(file, exchange)
    if form == "layout":
        save_layout(layout, output)
    else:
        if layout.interaction is not None:
            exchange.note(
                f"What the actuators do to each other is left out: {form} has no place for it."
            )
        write_whole(output, WRITERS[form](layout, exchange, suffix))
    return layout, exchange.notes


def read_any(file: str, exchange: Exchange) -> Layout:
    """Returns the layout in a file of any form; `exchange` says what to take where it is silent.
    Raises FinlabError: it cannot be read, or holds no form that is known."""
    path = Path(file)
    if file in shipped_layouts() or not is_regular(path) or path.suffix.lower() == ".zip":
        return load_layout(file)
    text = read_text(
        path, MAX_BYTES, "a robot description, parameters, a matrix or a layout", LayoutError
    )
    exchange.path = path.resolve()
    with under(source=file):
        return read_robot(text, path.name, exchange)


def read_robot(text: str, file: str, exchange: Exchange) -> Layout:
    """Returns the layout in the text of a file of this name, of any form. Raises LayoutError:
    something in it is wrong or missing, or it holds no form that is known."""
    path = Path(file)
    name = path.stem.strip()[:64].strip() or "robot"
    suffix = path.suffix.lower()
    if text.lstrip().startswith("<"):
        return read_description(text, name, exchange)
    if FORM_OF.get(suffix) != "layout":
        layout = _read_lines(text, name, suffix, exchange)
        if layout is not None:
            return layout
    data = (parse_json if suffix == ".json" else parse_yaml)(text, "", LayoutError)
    parts = data.get("actuators") if isinstance(data, dict) else None
    typed = isinstance(parts, list) and any(
        isinstance(part, dict) and "type" in part for part in parts
    )
    if isinstance(data, dict) and (typed or {"format", "fins"} & set(data)):
        folder = exchange.path.parent if exchange.path else None
        return parse_layout(data, "", folder, may_open=folder is not None)
    if not isinstance(data, dict | list):
        raise LayoutError(UNKNOWN)
    comments = [line for line in text.splitlines() if line.lstrip().startswith("#")]
    return read_plain(data, name, exchange, comments)


def _read_lines(text: str, name: str, suffix: str, exchange: Exchange) -> Layout | None:
    """The layout in lines of parameters, motors or cells; None where the text is none of these."""
    if "CA_ROTOR" in text:
        return read_px4(text, name, exchange)
    if "add_motor" in text:
        return motor_factors.of_motors(name, motor_factors.called(text), exchange)
    if motor_factors.OF_ARDUPILOT.search(text):
        return motor_factors.read_parameters_of_ardusub(text, name, exchange)
    if suffix in TABLES:
        table = table_of(text)
        if table.of_factors:
            return motor_factors.of_motors(name, motor_factors.tabled(table), exchange)
        return read_plain(plain_of(table), name, exchange, table.comments, table=True)
    if suffix in PARAMETERS and (n := len(read_parameters(text, ""))):
        names = (
            "neither CA_ROTOR_COUNT (PX4) nor FRAME_CONFIG (ArduSub), by which they name thrusters"
        )
        raise LayoutError(f"holds {n} parameters of an autopilot, but {names}")
    if suffix in PROGRAMS:
        raise LayoutError(
            "is a program without a call of add_motor_raw_6dof, by which ArduSub adds motors"
        )
    return None
