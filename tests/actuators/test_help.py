"""`help()` of a kind of actuator fits on a screen and says the unit of every argument."""

import inspect
import re
from dataclasses import fields

import pytest

import finlab
from finlab.actuators.actuator import Actuator
from finlab.layout import Servo, Uncertainty

KINDS = [finlab.Fin, finlab.Thruster, finlab.Azimuth, finlab.Tilt, finlab.Rudder]
"""The kinds of actuator that users make by hand."""
LONGEST_SIGNATURE = 300
"""Most characters of a signature: three lines of a terminal."""
MOST_LINES = 45
"""Most lines of a docstring: a screen."""
NO_UNIT = {"name", "alone", "hangs", "common"}
"""Arguments that are no quantities: texts and truth values."""


def arguments_of(docstring: str) -> dict[str, str]:
    """Arguments of a Google style docstring, with what it says of each."""
    section = docstring.split("Args:\n")[1].split("\n\n")[0]
    starts = re.split(r"^    (\w+): ", section, flags=re.MULTILINE)
    return dict(zip(starts[1::2], starts[2::2], strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_the_signature_is_short_and_has_all_arguments_in_order(kind: type[Actuator]) -> None:
    signature = inspect.signature(kind)
    assert len(str(signature)) <= LONGEST_SIGNATURE
    assert [*signature.parameters] == [field.name for field in fields(kind)]
    needed = [
        name
        for name, parameter in signature.parameters.items()
        if parameter.default is inspect.Parameter.empty
    ]
    with pytest.raises(TypeError, match=f"missing {len(needed)} required"):
        kind()


@pytest.mark.parametrize("kind", [*KINDS, Servo, Uncertainty])
def test_the_docstring_has_every_argument_with_its_unit(kind: type) -> None:
    docstring = inspect.getdoc(kind) or ""
    assert len(docstring.splitlines()) <= MOST_LINES
    arguments = arguments_of(docstring)
    assert {*arguments} == {field.name for field in fields(kind)}
    for name, meaning in arguments.items():
        assert name in NO_UNIT or re.search(r"\[[\w/^ ,]+\]|SI units", meaning), (name, meaning)
