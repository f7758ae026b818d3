"""What is said of an answer: its figures, what is missing, what is not certain, and what a program
reads. Sentences are asked for the numbers and names in them."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.actuators.actuator import Uncertainty
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation.report import (
    allocation_blocks,
    answer_notes,
    command_record,
    doubts,
    fin_notes,
    missing_words,
    next_measurement,
    plain_target,
    remarks,
    share_words,
    summary,
)
from finlab.display import Table
from finlab.interaction.jets import Jets
from finlab.interaction.linear import Linear
from finlab.layout import Azimuth, Fin, Layout, Limits, Thruster
from finlab.physics import plant_of

ORIGIN = (0.0, 0.0, 0.0)
LAW = PowerLaw(1.0)


def numbers_in(sentence: str) -> list[float]:
    """All numbers of a sentence."""
    return [float(word) for word in re.findall(r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?", sentence)]


def answer(**fields: Any) -> Any:
    """Stands for an answer of which little is asked."""
    usual = {
        "notes": (),
        "binding": (),
        "unknown_fins": (),
        "reachable": False,
        "share": 1.0,
        "scale": np.ones(6),
        "unallocated": np.zeros(6),
        "target": np.ones(6),
        "measure_next": "",
        "bound": None,
        "calm_power": 0.0,
        "previous": None,
        "layout": SimpleNamespace(interaction=None),
        "budget": None,
        "power": 100.0,
    }
    return SimpleNamespace(**(usual | fields))


def test_what_binds_and_notes_stand_beside_what_is_missing() -> None:
    said = remarks(answer(share=0.25, binding=("a at full thrust", "rate of b"), notes=("note",)))
    assert said[1:] == ["note"]
    assert said[0].endswith("; a at full thrust; rate of b")
    assert remarks(answer(reachable=True, notes=("note",))) == ["note"]
    assert remarks(answer(unknown_fins=("a",), notes=("note",))) == ["note"]


@pytest.mark.parametrize(
    ("bound", "calm_power", "percents"),
    [
        (None, 0.0, []),
        (100.0, 0.0, []),
        (99.5, 0.0, []),
        (99.5, 20.0, []),
        (80.0, 0.0, [25.0]),
        (80.0, 20.0, [20.0]),  # all of it goes into less turning
        (70.0, 20.0, [20.0, 11.0]),
        (70.0, 0.5, [43.0]),  # too little to tell
    ],
)
def test_power_above_its_bound_is_told_and_what_of_it_saves_turning(
    bound: float | None, calm_power: float, percents: list[float]
) -> None:
    told = doubts(answer(bound=bound, calm_power=calm_power))
    assert [numbers_in(sentence)[0] for sentence in told] == percents
    assert any("calm" in sentence for sentence in told) == (calm_power > 1.0 and bool(percents))


def test_why_a_bound_may_be_low_is_told() -> None:
    coupled = SimpleNamespace(interaction=Jets())
    (by_jets,) = doubts(answer(bound=50.0, layout=coupled))
    (at_rest,) = doubts(answer(bound=50.0))
    (in_tick,) = doubts(answer(bound=50.0, previous=np.zeros((1, 3))))
    assert "jets" in by_jets and "jets" not in at_rest
    assert "rates" in in_tick and "rates" not in at_rest
    first, _ = doubts(answer(bound=50.0, measure_next="measure a next"))
    assert first == "measure a next"


def two_thrusters() -> Layout:
    """Two thrusters along x that are uncertain by 10 % and 30 % of their forces."""
    parts = (
        Thruster(name, (0.0, y, 0.0), (1.0, 0.0, 0.0), (-40.0, 40.0), LAW, uncertainty=share)
        for name, y, share in (
            ("port", 0.5, Uncertainty(share=0.1)),
            ("starboard", -0.5, Uncertainty(share=0.3)),
        )
    )
    return Layout("two", tuple(parts))


@pytest.mark.parametrize(
    ("forces", "named"),
    [((10.0, 10.0), "starboard"), ((30.0, 5.0), "port"), ((-30.0, 5.0), "port")],
)
def test_what_adds_most_to_the_expected_error_is_measured_next(
    forces: tuple[float, float], named: str
) -> None:
    layout = two_thrusters()
    scale = np.array([10.0, 10, 10, 2, 2, 2])
    command = np.array([[force, 0.0, 0.0] for force in forces])
    deviation = np.abs(forces) * np.array([0.1, 0.3])
    # Each is off along x, and turns about z by its lever of 0.5 m.
    error = deviation * math.hypot(1.0 / 10.0, 0.5 / 2.0)
    asked = SimpleNamespace(
        command=command, scale=scale, expected_error=float(np.linalg.norm(error))
    )
    sentence = next_measurement(asked, plant_of(layout))
    other = "port" if named == "starboard" else "starboard"
    assert f"measure {named} next" in sentence and other not in sentence
    whole, without = numbers_in(sentence)
    assert whole == pytest.approx(np.linalg.norm(error), rel=0.06)
    assert without == pytest.approx(error.min(), rel=0.06)


def test_the_tables_of_an_answer_have_its_forces_and_wrenches() -> None:
    layout = load_layout("bluerov2_heavy")
    result = Allocator(layout).allocate(
        [20.0, -1e-5, 5.0, 0.0, 0.0, -1e-9], lost=["rear_left"], free=("Ty",)
    )
    actuators, wrenches, words = allocation_blocks(result)
    assert isinstance(actuators, Table) and isinstance(wrenches, Table)
    for row, name, force in zip(actuators.rows, layout.names, result.forces, strict=True):
        assert row[0] == name
        if name == "rear_left":
            assert row[2:] == ("lost", "")
        else:
            assert float(row[3]) == pytest.approx(np.linalg.norm(force), abs=6e-4)
    asked, delivered, missing = wrenches.rows
    assert asked[0] == "asked" and asked[5] == "free"
    shown = [float(cell) for cell in delivered[1:]]
    np.testing.assert_allclose(shown, result.wrench, atol=6e-4)
    # What is rounded to nothing has no sign.
    assert not any(cell == "-0.000" for row in (asked, delivered, missing) for cell in row)
    assert asked[2] == "0.000"
    assert summary(result) in str(words)


def test_a_program_reads_forces_along_the_thrusters_and_whole_ones_of_pods() -> None:
    pod = Azimuth("pod", ORIGIN, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 40.0), LAW)
    aslant = (0.6, -0.8, 0.0)
    screw = Thruster("screw", ORIGIN, aslant, (-30.0, 30.0), LAW)
    layout = Layout("two", (pod, screw))
    command = np.array([[0.5, 20.0, 0.0], [-10.0, 0.0, 0.0]])
    forces = np.array([[20.0 * math.cos(0.5), 20.0 * math.sin(0.5), 0.0], -10.0 * np.array(aslant)])
    record: Any = command_record(layout, command, forces)
    assert set(record) == {"actuators"}  # fins have keys of their own
    first, second = record["actuators"]
    assert first["force_n"] == pytest.approx(forces[0].tolist())
    assert second["force_n"] == pytest.approx(-10.0)
    command[1] = np.nan
    lost: Any = command_record(layout, command, forces)
    assert lost["actuators"][1]["command"] is None and lost["actuators"][0]["command"] is not None


def test_an_axis_that_is_free_is_null() -> None:
    target = np.array([1.0, np.nan, 0.0, -2.0, np.nan, 0.5])
    assert plain_target(target) == [1.0, None, 0.0, -2.0, None, 0.5]


@pytest.mark.parametrize("share", [1e-3, -1e-3])
def test_what_is_asked_of_axes_that_nothing_gives_or_that_do_not_count_is_told(
    share: float,
) -> None:
    layout = Layout("one", two_thrusters().actuators, axes=("Fx", "Tz", "Fz"))
    method = Allocator(layout)._whole.method
    target = np.zeros((2, 6))
    assert answer_notes(layout, method, None, target) == ()
    target[1, 2] = share * method.scale[2]
    (undriven,) = answer_notes(layout, method, None, target)
    assert "Fz" in undriven and "no actuator" in undriven
    target = np.zeros(6)
    target[1] = share * method.scale[1]
    told = answer_notes(layout, method, None, target, own=("own",))
    assert told[0] == "own" and "Fy" in told[-1] and "axes" in told[-1]
    target[:] = 0.0
    target[0] = share * method.scale[0]
    assert answer_notes(layout, method, None, target) == ()


def test_foils_and_jets_say_what_a_flow_tells() -> None:
    rudders = tuple(
        Rudder(name, (-1.0, y, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.03, (-0.5, 0.5), 3.0)
        for name, y in (("left", 0.1), ("right", -0.1))
    )
    (both,) = fin_notes(Layout("tail", rudders))
    assert both.startswith("rudders left, right give nothing at rest")
    surge = np.array([1.0, 0, 0, 0, 0, 0])
    pods = Layout(
        "pods",
        (
            Azimuth("known", ORIGIN, (0, 0, 1), (1, 0, 0), (0, 40), LAW, diameter=0.1),
            Thruster("guessed", ORIGIN, (1, 0, 0), (0, 40), LAW, diameter=0.1),
            Thruster(
                "measured", ORIGIN, (1, 0, 0), (0, 40), LAW, diameter=0.1, open_water=(0.4, 0.8)
            ),
        ),
        interaction=Jets(),
    )
    (guess,) = fin_notes(pods, surge)
    assert "known, guessed" in guess and "measured" not in guess
    assert fin_notes(pods) == ()
    assert fin_notes(replace(pods, interaction=Linear()), surge) == ()


@pytest.mark.parametrize(("least", "is_restless"), [(0.03, False), (0.2, True)])
def test_a_fin_that_always_pushes_is_told_of(least: float, is_restless: bool) -> None:
    """Its force grows with the square of its frequency: the least over the largest one is known."""
    limits = Limits((0.5, 0.5), (2.0 * math.sqrt(least), 2.0))
    (note, *others) = fin_notes(Layout("fin", (Fin("fin", ORIGIN, 0.0, limits),))) or ("",)
    assert not others
    if not is_restless:
        assert note == ""
        return
    smallest, largest = numbers_in(note)
    assert smallest / largest == pytest.approx(least, rel=0.01)


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.0, ["0 % of the wrench is delivered"]),
        (0.426, ["43 % of the wrench is delivered"]),
        (0.994, ["99 % of the wrench is delivered"]),
        (0.9951, []),
        (1.0, []),
        (1.7, []),
        (-0.2, []),
    ],
)
def test_how_much_is_delivered_is_said_between_nothing_and_all(
    share: float, words: list[str]
) -> None:
    assert share_words(answer(share=share)) == words


def test_what_is_missing_is_said_by_the_size_that_counts() -> None:
    """Along z 3 N of 30 N are missing, and 2 N m come along that nobody asked for."""
    result = answer(
        unallocated=np.array([0.0, 0.0, 3.0, 0.0, -2.0, 1e-4]),
        target=np.array([0.0, 0.0, 30.0, 0.0, 0.0, 1.0]),
        scale=np.array([10.0, 10.0, 10.0, 2.0, 2.0, 2.0]),
    )
    words = missing_words(result)
    undone, _, unasked = words.partition(";")
    assert numbers_in(undone) == [3.0] and "heave is left undone" in undone
    assert numbers_in(unasked) == [2.0] and "pitch comes along unasked" in unasked
