"""Writes a judged log as MCAP, which Foxglove and PlotJuggler open; `finlab log --mcap`.

Messages are JSON with a JSON Schema (encodings `json` and `jsonschema` of MCAP). Sentences are
`foxglove.Log`, which Foxglove's Log panel shows; numbers are channels to plot. Times are those of
the log's clock. The whole judgement is attached as `judgement.json`.
"""

from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from msgspec import json

import finlab
from finlab.actuators.thruster import Thruster
from finlab.arrays import AnyArray, Array
from finlab.assets import install_command
from finlab.errors import DataError
from finlab.log.judgement import Judgement
from finlab.log.judgement_text import lost_words
from finlab.log.judging import Account
from finlab.log.read import Log
from finlab.physics.plant import plant_of
from finlab.whole_file import write_whole

SUFFIX = ".mcap"
"""Suffix of a file of MCAP."""
PREFIX = "/finlab/"
"""What all topics begin with."""
MAX_TIME_S = 9e9
"""Latest time that MCAP's clock of nanoseconds holds, almost [s]."""
INFO = 2
WARNING = 3
"""Levels of `foxglove.Log`."""
NUMBER = {"type": ["number", "null"]}
"""JSON Schema of a number, which may be missing."""
VECTOR = {"type": "object", "properties": {"x": NUMBER, "y": NUMBER, "z": NUMBER}}
"""JSON Schema of a vector."""
WRENCH = {
    "type": "object",
    "description": "wrench in the body frame, x forward, y left, z up [N, N m]",
    "properties": {"force": VECTOR, "torque": VECTOR},
}
"""JSON Schema of a wrench."""
WHOLE = {"type": "integer"}
"""JSON Schema of a whole number."""
TEXT = {"type": "string"}
"""JSON Schema of text."""
LOG_MESSAGE = {
    "title": "foxglove.Log",
    "type": "object",
    "properties": {
        "timestamp": {"type": "object", "properties": {"sec": WHOLE, "nsec": WHOLE}},
        "level": WHOLE,
        "message": TEXT,
        "name": TEXT,
        "file": TEXT,
        "line": WHOLE,
    },
}
"""JSON Schema of a sentence at a time, with the fields that Foxglove knows."""


class Sentence(NamedTuple):
    """A sentence at a time of the log."""

    time: float
    """On the log's clock [s]."""
    level: int
    message: str


def check_mcap_file(path: Path | None) -> None:
    """Refuses, before the work, a file that could not be written after it.

    Args:
        path: the file, or None where none is asked for.

    Raises:
        DataError: the package `mcap` is not installed, the folder is missing, or the name has
            another ending.
    """
    if path is None:
        return
    if path.suffix.lower() != SUFFIX or path.is_dir() or not path.absolute().parent.is_dir():
        raise DataError(
            f"mcap: expected a file in an existing folder that ends in {SUFFIX}, got {path}"
        )
    try:
        import mcap  # noqa: F401
    except ImportError as error:
        raise DataError(f"mcap: mcap is not installed; run: {install_command('logs')}") from error


def write_mcap(log: Log, judgement: Judgement, path: Path) -> None:
    """Writes a log and its judgement as MCAP.

    Args:
        log: the log.
        judgement: of `judge`.
        path: the file.

    Raises:
        DataError: it cannot be written, or the log's clock is no clock.
    """
    from mcap.writer import Writer

    if np.abs(log.time).max() > MAX_TIME_S:
        raise DataError(
            f"{path}: the clock of {log.source} reads up to {log.time.max():.3g} s, expected "
            f"times up to {MAX_TIME_S:.0e} s"
        )
    content = BytesIO()
    writer: Any = Writer(content)  # its types are half there
    writer.start(library=f"finlab {finlab.__version__}")
    _write_sentences(writer, "verdict", _verdict(log, judgement))
    _write_sentences(writer, "spells", _spells(judgement))
    _write_sentences(
        writer, "events", [Sentence(time, WARNING, words) for time, words in judgement.events]
    )
    account = Account(log)
    for topic, wrench in (
        ("asked", log.demand),
        ("given", account.delivered),
        ("missing", account.missing),
    ):
        _write_rows(writer, topic, "finlab.Wrench", WRENCH, log.time, _wrench_values(wrench))
    if log.command is not None:
        schema, values = _force_values(log)
        _write_rows(writer, "forces", "finlab.Forces", schema, log.time, values)
        names = log.robot.names
        flags = [dict(zip(names, row, strict=True)) for row in account.is_limited.tolist()]
        schema = _object(dict.fromkeys(names, {"type": "boolean"}), "whether each is at a limit")
        _write_rows(writer, "at_limit", "finlab.AtLimit", schema, log.time, flags)
    writer.add_attachment(
        create_time=0,
        log_time=_nanoseconds(log.time[0]),
        name="judgement.json",
        media_type="application/json",
        data=json.encode(judgement.to_dict()),
    )
    writer.finish()
    write_whole(path, content.getvalue(), DataError)


def _object(properties: dict[str, Any], description: str) -> dict[str, Any]:
    """JSON Schema of an object."""
    return {"type": "object", "description": description, "properties": properties}


def _nanoseconds(time: float) -> int:
    """A time of the log's clock [ns]; MCAP has none before 0."""
    return max(0, round(float(time) * 1e9))


def _verdict(log: Log, judgement: Judgement) -> list[Sentence]:
    """The judgement in a sentence, then what the log lacks and how it was read."""
    begin = float(log.time[0])
    level = INFO if judgement.axis is None else WARNING
    sentences = [Sentence(begin, level, judgement.sentence)]
    for words in (*judgement.asks, *judgement.notes):
        sentences.append(Sentence(begin, INFO, words))
    return sentences


def _spells(judgement: Judgement) -> list[Sentence]:
    """What was lost in each spell, at its beginning and at its end."""
    sentences = []
    for spell in judgement.spells:
        why = f", with {', '.join(spell.limits)}" if spell.limits else ""
        lost = f"lost {lost_words(spell)}{why}, for {spell.end - spell.start:.1f} s"
        sentences.append(Sentence(spell.start, WARNING, lost))
        sentences.append(Sentence(spell.end, INFO, f"{', '.join(spell.axes)} held again"))
    return sentences


def _wrench_values(wrench: Array) -> list[dict[str, Any]]:
    """Wrenches (N, 6) as the values of messages; NaN along axes that do not count."""
    values = []
    for row in _plain(wrench):
        force, torque = (dict(zip("xyz", part, strict=True)) for part in (row[:3], row[3:]))
        values.append({"force": force, "torque": torque})
    return values


def _force_values(log: Log) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """JSON Schema and values of the actuators' forces: a number along the axis of a thruster, and a
    vector in the body frame for any other; NaN for one that was stopped."""
    robot = log.robot
    assert log.command is not None
    in_body = plant_of(robot).body_forces(log.command)
    in_body[np.isnan(log.command).any(axis=-1)] = np.nan
    properties: dict[str, Any] = {}
    columns: list[list[Any]] = []
    for i, actuator in enumerate(robot.actuators):
        if isinstance(actuator, Thruster):
            properties[actuator.name] = NUMBER
            columns.append(_plain(in_body[:, i] @ np.array(actuator.axis)))
        else:
            properties[actuator.name] = VECTOR
            rows = _plain(in_body[:, i])
            columns.append([dict(zip("xyz", row, strict=True)) for row in rows])
    values = [dict(zip(robot.names, row, strict=True)) for row in zip(*columns, strict=True)]
    return _object(properties, "force of each actuator [N]"), values


def _plain(values: AnyArray) -> list[Any]:
    """Numbers as lists, with six digits behind the point; JSON has NaN as null."""
    numbers: list[Any] = (np.round(values, 6) + 0.0).tolist()
    return numbers


def _write_sentences(writer: Any, topic: str, sentences: list[Sentence]) -> None:
    """Writes a channel of sentences."""
    times = np.array([sentence.time for sentence in sentences])
    values = []
    for sentence in sentences:
        seconds, nanoseconds = divmod(_nanoseconds(sentence.time), 10**9)
        message = {
            "timestamp": {"sec": seconds, "nsec": nanoseconds},
            "level": sentence.level,
            "message": sentence.message,
            "name": f"finlab {topic}",
            "file": "",
            "line": 0,
        }
        values.append(message)
    _write_rows(writer, topic, "foxglove.Log", LOG_MESSAGE, times, values)


def _write_rows(
    writer: Any,
    topic: str,
    name: str,
    schema: dict[str, Any],
    time: Array,
    values: list[dict[str, Any]],
) -> None:
    """Writes a channel.

    Args:
        writer: of MCAP.
        topic: the end of its topic.
        name: name of the schema.
        schema: JSON Schema of its messages.
        time: times of the messages (N,) [s].
        values: the messages.
    """
    number = writer.register_schema(name, "jsonschema", json.encode(schema))
    channel = writer.register_channel(f"{PREFIX}{topic}", "json", number)
    encoder = json.Encoder()
    for sequence, (at, value) in enumerate(zip(time.tolist(), values, strict=True)):
        stamp = _nanoseconds(at)
        writer.add_message(channel, stamp, encoder.encode(value), stamp, sequence)
