"""Parameter files of autopilots: scripts of PX4, and the lists of ground stations."""

import re
from collections.abc import Mapping

_LINE = re.compile(
    r"(?:^|[\s,])([A-Z][A-Z0-9]*_\w+)[\s,=]+([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)(?=[\s,]|$)"
)
LONGEST = 500
"""Most characters of a line that are looked at."""


def read_parameters(text: str) -> dict[str, float]:
    """Returns parameters by name: of lines `param set-default NAME VALUE`, `NAME VALUE`, `NAME,VALUE`, and
    those of QGroundControl, `1 1 NAME VALUE TYPE`. What follows # is a comment; the last value counts."""
    lines = (_LINE.search(line[:LONGEST].partition("#")[0]) for line in text.splitlines())
    return {found[1]: float(found[2]) for found in lines if found and abs(float(found[2])) < 1e9}


def parameters_text(values: Mapping[str, float], names: list[str], suffix: str, script: str) -> str:
    """Returns parameters as a file: for the suffix `.params` a list of QGroundControl, else lines that begin
    with `script`. Comments say which motor is which of `names`."""
    lines = [f"# motor {i}: {name}" for i, name in enumerate(names, 1)]
    for key, value in values.items():
        kind = 6 if isinstance(value, int) else 9  # of MAVLink: 32 bits, whole or not
        lines.append(f"1\t1\t{key}\t{value!r}\t{kind}" if suffix == ".params" else f"{script}{key} {value!r}")
    return "\n".join(lines) + "\n"
