"""Which file holds which form, told by its end and content, and one form made into another."""

import os
import re
from collections.abc import Callable
from pathlib import Path

from finlab.assets import shipped_layouts
from finlab.errors import CommandError, LayoutError
from finlab.exchange.ardusub import read_ardusub, write_ardusub
from finlab.exchange.description_text import SDF, URDF, description_text
from finlab.exchange.exchange import Exchange
from finlab.exchange.gazebo import read_description
from finlab.exchange.matrix import csv_values, read_matrix, write_matrix
from finlab.exchange.px4 import read_px4, write_px4
from finlab.files.guarded import is_regular, read_text
from finlab.files.plain_values import parse_json, parse_yaml
from finlab.layout import Layout, load_layout, save_layout
from finlab.layout.file import parse_layout
from finlab.layout.file_form import under
from finlab.whole_file import write_whole

MAX_BYTES = 5_000_000
"""Largest file that is read; meshes are files of their own and are not touched."""
WRITERS: dict[str, Callable[[Layout, Exchange, str], str]] = {
    "urdf": lambda layout, exchange, _: description_text(layout, exchange, URDF),
    "sdf": lambda layout, exchange, _: description_text(layout, exchange, SDF),
    "px4": write_px4,
    "ardusub": write_ardusub,
    "matrix": write_matrix,
}
"""Forms beside layout files that are written: the text for a layout and the suffix of the file."""
FORM_OF = {".urdf": "urdf", ".sdf": "sdf", ".params": "px4"}
FORM_OF |= {".cpp": "ardusub", ".csv": "matrix", ".yaml": "layout", ".yml": "layout", ".json": "layout"}
"""What a suffix stands for where the user does not say."""
FOREIGN = tuple(suffix for suffix, form in FORM_OF.items() if form not in ("layout", "matrix"))
"""Suffixes of robot descriptions, and of what autopilots read."""


def convert(file: str, output: str | os.PathLike[str], to: str | None, exchange: Exchange) -> Layout:
    """Makes one file into another, and returns the layout that went through.

    `file` is of any form, a bundle, or the name of a shipped layout; `to` is `layout` or one of `WRITERS`, by
    the suffix of the output when None.

    Raises:
        FinlabError: a file cannot be read or written, or the output's suffix says no form.
    """
    suffix = Path(output).suffix.lower()
    form = to or FORM_OF.get(suffix)
    if form is None:
        raise CommandError(f"{output}: its end says no form; say --to {', '.join(['layout', *WRITERS])}")
    layout = read_any(file, exchange)
    if form == "layout":
        save_layout(layout, output)
    else:
        write_whole(output, WRITERS[form](layout, exchange, suffix))
    return layout


def read_any(file: str, exchange: Exchange) -> Layout:
    """Returns the layout in a file of any form; `exchange` says what to take where it is silent.

    Raises:
        FinlabError: it cannot be read, or holds no form that is known.
    """
    path = Path(file)
    if file in shipped_layouts() or not is_regular(path) or path.suffix.lower() == ".zip":
        return load_layout(file)
    text = read_text(path, MAX_BYTES, "a robot description, parameters, a matrix or a layout", LayoutError)
    name = path.stem.strip()[:64].strip() or "robot"
    suffix = path.suffix.lower()
    with under(source=file):
        found = read_foreign(text, name, suffix, exchange)
        if found is not None:
            return found
        if suffix == ".csv":
            return read_matrix(csv_values(text), name, exchange)
        data = (parse_json if suffix == ".json" else parse_yaml)(text, "", LayoutError)
        if isinstance(data, dict) and {"format", "fins", "actuators"} & set(data):
            return parse_layout(data, "", path.resolve().parent)
        return read_matrix(data, name, exchange)


def read_foreign(text: str, name: str, suffix: str, exchange: Exchange) -> Layout | None:
    """Returns the layout, called `name`, in a robot description or in what autopilots read; None where the
    text of a file with this suffix is neither.

    Raises:
        LayoutError: something in it is wrong, or missing.
    """
    if text.lstrip().startswith("<"):
        return read_description(text, name, exchange)
    if FORM_OF.get(suffix) != "layout" and "CA_ROTOR" in text:
        return read_px4(text, name, exchange)
    if FORM_OF.get(suffix) != "layout" and re.search(r"add_motor|(?i:throttle\W+forward)", text):
        return read_ardusub(text, name, exchange)
    return None
