"""Numbers with units and arithmetic: what is read, and what is refused in a sentence."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from finlab.errors import FinlabError
from webapp.session.quantities import MAX_TEXT, UNITS, read_number


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("12 cm", "m", 0.12),
        ("12cm", "m", 0.12),
        ("0.12", "m", 0.12),
        ("30 mm + 1 cm", "m", 0.04),
        ("2 * (3 mm + 1 cm)", "m", 0.026),
        ("1/2 m", "m", 0.5),
        ("2 in", "m", 0.0508),
        ("-0.5", "N", -0.5),
        ("−0.5", "N", -0.5),
        ("300 mN", "N", 0.3),
        (".03", "", 0.03),
        ("1.", "", 1.0),
        ("1e-2", "", 0.01),
        ("1E+2", "N", 100.0),
        ("1/3", "", 1 / 3),
        ("2^3", "", 8.0),
        ("2**-1", "", 0.5),
        ("-2^2", "", -4.0),
        ("6/2/3", "", 1.0),
        ("5 - 2 - 1", "", 2.0),
        ("--5", "", 5.0),
        ("30,5", "N", 30.5),
        ("3 N cm", "N m", 0.03),
        ("0.2 Nm", "N m", 0.2),
        ("1.5 kg * 9.81 m/s^2", "N", 14.715),
        ("45 deg", "°", 45.0),
        ("45°", "°", 45.0),
        ("pi/4 rad", "°", 45.0),
        ("0.1 m/s", "cm/s", 10.0),
        ("50 %", "%", 50.0),
        ("50", "%", 50.0),
        ("0.1 kWh", "Wh", 100.0),
        ("360 kJ", "Wh", 100.0),
        ("60 / min", "Hz", 1.0),
    ],
)
def test_is_read(text: str, unit: str, value: float) -> None:
    assert read_number(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "-",
        "1/",
        "1e",
        "1 2",
        "1 000",
        "1.2.3",
        "0,1,2",
        "(1",
        "1)",
        "()",
        "3 +",
        "a",
        "1 cm + 2",
        "x 3",
    ]
    + ["nan", "inf", "1/0", "1e999", "9^9^9", "2^0.5", "2^1000", "__import__('os')", "os.system", "1;2", "=1"]
    + ["c m", "12 kg", "12 cm^2", "5 %", "1" * (MAX_TEXT + 1), "(" * 90 + "1" + ")" * 9, "٣", "١٢", "1_000"],
)
def test_is_refused_in_a_sentence(text: str) -> None:
    with pytest.raises(FinlabError, match="type for example 12 cm") as refused:
        read_number(text, "m")
    assert len(str(refused.value)) < 120


def test_another_unit_is_named() -> None:
    with pytest.raises(FinlabError, match=r"^'12 kg' is not in m; type for example 12 cm$"):
        read_number("12 kg", "m")
    with pytest.raises(FinlabError, match="is not without a unit"):
        read_number("3 m", "")


@given(st.floats(-1e6, 1e6), st.sampled_from(sorted(UNITS.keys() - {"pi", "π"})))
def test_any_number_comes_back(value: float, unit: str) -> None:
    assert read_number(f"{value!r} {unit}", unit) == pytest.approx(value, rel=1e-12, abs=1e-12)
    assert read_number(repr(value), unit) == value


@given(st.text(max_size=120), st.sampled_from(["", "m", "°", "N m"]))
def test_no_text_does_anything_but_be_read_or_refused(text: str, unit: str) -> None:
    try:
        assert math.isfinite(read_number(text, unit))
    except FinlabError as refused:
        assert "type for example" in str(refused)
