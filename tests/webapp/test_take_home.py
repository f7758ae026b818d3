"""What a robot is taken home as: files that are read back and push as it does, scripts that print
the page's answer, and sentences where a format cannot hold it.

The judges are the library's readers with the effectiveness of what they read, the ROS 2 node's own
check of its parameters, a compiler, and Python.
"""

import io
import json
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from finlab_allocator.parameters import Parameters

from finlab.assets import shipped_layouts
from finlab.deploy.c_sources import c_sources
from finlab.deploy.ros_parameters import ros_parameters
from finlab.errors import CommandError, FinlabError
from finlab.exchange import Exchange, convert, read_robot
from finlab.layout import Damage, Layout, Thruster, load_layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.research.networks.checkpoint import resolve_checkpoint
from webapp.markup.python_script import script_of
from webapp.session import Session, files
from webapp.session.state import State
from webapp.tasks.solver import Solver
from webapp.tasks.take_home import BY_KEY, FORMATS, Format, HomeQuestion, offers_of

TARGET = (1.2, 0.0, 0.0, 0.0, 0.0, 0.25)
"""Wrench that is asked for [N, N m]."""
OF_THRUSTERS = ("bluerov2", "bluerov2_heavy")
"""Shipped robots of thrusters alone."""


def question_of(layout: Layout, **state: Any) -> HomeQuestion:
    """What is taken home of a robot."""
    return HomeQuestion.of_state(State(layout, target=TARGET, **state))


def crooked() -> Layout:
    """A robot of thrusters with reaction torques and odd places."""
    layout = load_layout("bluerov2_heavy")
    actuators = []
    for index, thruster in enumerate(layout.actuators):
        assert isinstance(thruster, Thruster)
        torque = 0.011 * (-1) ** index
        place = tuple(np.add(thruster.position, 0.01 * index).tolist())
        actuators.append(replace(thruster, torque_per_newton=torque, position=place))
    return replace(layout, name="crooked", actuators=tuple(actuators))


def wrenches_of(layout: Layout, forces: np.ndarray) -> np.ndarray:
    """Wrenches (N, 6) of forces (N, n) of a robot of thrusters."""
    return np.asarray(forces @ own_effectiveness(layout)[:, 0])


@pytest.mark.parametrize("key", ["px4", "matrix", "urdf", "sdf", "mjcf"])
def test_what_is_read_back_pushes_alike(key: str) -> None:
    """Random commands give the same wrench; a description has no reaction torque."""
    layout = crooked()
    written = BY_KEY[key].write(question_of(layout))
    name = BY_KEY[key].file_name(layout)
    again = read_robot(written.content.decode(), name, Exchange(origin="base"))
    assert again.n == layout.n
    expected = layout
    if key in ("urdf", "sdf"):
        assert any("reaction torques" in note for note in written.notes)
        actuators = [replace(each, torque_per_newton=0.0) for each in layout.actuators]
        expected = replace(layout, actuators=tuple(actuators))
    forces = np.random.default_rng(3).uniform(-20.0, 20.0, (50, layout.n))
    error = np.abs(wrenches_of(again, forces) - wrenches_of(expected, forces)).max()
    assert error < 1e-9


def test_factors_of_ardusub_point_alike() -> None:
    """Each column of factors is one of the effectiveness, up to its size and the signs of FRD."""
    layout = load_layout("bluerov2_heavy")
    written = BY_KEY["ardusub"].write(question_of(layout))
    again = read_robot(written.content.decode(), "motors.cpp", Exchange())
    assert again.n == layout.n
    own = own_effectiveness(layout)[:, 0, :3]
    read = own_effectiveness(again)[:, 0, :3]
    # Factors of an axis are scaled by the largest of that axis: signs and zeros stay.
    assert np.array_equal(np.sign(np.round(own, 6)), np.sign(np.round(read, 6)))


EXCHANGED = [form for form in FORMATS if form.key not in ("c", "ros")]
"""Formats of others, which the command line writes as well."""


@pytest.mark.parametrize("form", EXCHANGED, ids=lambda form: form.key)
@pytest.mark.parametrize("name", ["bluerov2_heavy", "ucat", "mixed"])
def test_files_are_those_of_the_command_line(form: Format, name: str, tmp_path: Path) -> None:
    layout = load_layout(name)
    file = tmp_path / f"robot{form.end}"
    try:
        content = form.write(question_of(layout)).content
    except FinlabError as error:
        with pytest.raises(type(error)):
            convert(name, file, form.key, Exchange())
        return
    convert(name, file, form.key, Exchange())
    assert file.read_bytes() == content


def test_c_is_that_of_the_command_line_and_passes_its_self_test(tmp_path: Path) -> None:
    layout = load_layout("bluerov2_heavy")
    lost = layout.names[0]
    written = BY_KEY["c"].write(question_of(layout, damage=Damage([lost])))
    expected = c_sources(layout.without([lost]))
    with zipfile.ZipFile(io.BytesIO(written.content)) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == expected
        archive.extractall(tmp_path)
    assert any(lost in note for note in written.notes)
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no compiler here")
    sources = [str(path) for path in tmp_path.glob("*.c")]
    built = [compiler, "-std=c99", "-O1", "-o", str(tmp_path / "test"), *sources, "-lm"]
    subprocess.run(built, check=True)
    subprocess.run([str(tmp_path / "test")], check=True, stdout=subprocess.PIPE)


def test_the_node_takes_its_parameters() -> None:
    layout = load_layout("bluerov2_heavy")
    state = State(
        layout, target=TARGET, policy="direction", damage=Damage([layout.names[1], layout.names[3]])
    )
    written = BY_KEY["ros"].write(HomeQuestion.of_state(state))
    values = yaml.safe_load(written.content)["/**"]["ros__parameters"]
    parameters = Parameters().changed(values)
    assert parameters.robot == "bluerov2_heavy"
    assert parameters.policy == "direction"
    assert parameters.lost == (layout.names[1], layout.names[3])
    whole = BY_KEY["ros"].write(question_of(crooked()))
    values = yaml.safe_load(whole.content)["/**"]["ros__parameters"]
    assert values == {"robot": "crooked.yaml", "policy": "closest"}
    assert "crooked.yaml" in whole.notes[0]
    with pytest.raises(CommandError, match="policy: expected one of closest"):
        ros_parameters("ucat", "best")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", shipped_layouts())
def test_each_robot_has_formats_or_reasons_in_the_pages_words(name: str) -> None:
    offers = offers_of(question_of(load_layout(name)))
    assert [offer.format for offer in offers] == list(FORMATS)
    for offer in offers:
        for sentence in (*offer.notes, offer.reason):
            assert "--" not in sentence and "finlab layout" not in sentence
            assert sentence == "" or (sentence[0].isupper() or "`" in sentence), sentence
        assert offer.reason == "" or not offer.notes
    reasons = {offer.format.key: offer.reason for offer in offers}
    if not any(isinstance(each, Thruster) for each in load_layout(name).actuators):
        assert "has no thruster" in reasons["px4"]
        assert "has no thruster, and a matrix has a place" in reasons["matrix"]
    else:
        assert reasons["px4"] == ""
    for key in ("c", "ros", "urdf", "sdf", "mjcf"):
        assert reasons[key] == ""


def test_what_c_does_not_know_is_said() -> None:
    layout = load_layout("bluerov2_heavy")
    offers = {
        offer.format.key: offer
        for offer in offers_of(question_of(layout, damage=Damage(layout.names)))
    }
    assert offers["c"].reason.startswith("Nothing of this robot works")
    session = Session(layout)
    session.set_jets(True)
    offers = {offer.format.key: offer for offer in offers_of(HomeQuestion.of_state(session.state))}
    assert "switch Jets off" in offers["c"].reason
    assert any("do to each other is left out" in note for note in offers["px4"].notes)
    torpedo = load_layout("torpedo")
    notes = " ".join(BY_KEY["c"].write(question_of(torpedo)).notes)
    assert "At rest rudder_top" in notes
    notes = " ".join(BY_KEY["c"].write(question_of(torpedo, speed=1.5)).notes)
    assert "1.5 m/s" in notes


UCAT = load_layout("ucat")
STATES = {
    "shipped": State(UCAT, target=TARGET),
    "damaged": State(
        load_layout("octo"),
        Damage(
            [load_layout("octo").names[0]],
            weak={load_layout("octo").names[1]: 0.5},
            stuck={load_layout("octo").names[2]: 0.25},
        ),
        target=(1.0 / 3.0, 0.0, -0.2, 0.0, 0.0, 0.1),
    ),
    "freed": State(
        replace(load_layout("bluerov2_heavy"), axes=("Fx", "Fy", "Fz", "Tz")),
        target=(20.0, 5.0, 3.0, 1.0, 1.0, 1.0),
    ),
    "out of reach": State(UCAT, target=(100.0, 0.0, 3.0, 0.0, 0.0, 0.5), policy="direction"),
    "flow": State(load_layout("torpedo"), target=(3.0, 0.0, 0.0, 0.0, 0.1, 0.1), speed=1.0),
    "mdn": State(UCAT, target=TARGET, method="mdn", temperature=0.5),
    "qp": State(UCAT, target=TARGET, method="qp"),
    "own": State(crooked(), target=(10.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
    "own and freed": State(
        replace(crooked(), axes=("Fx", "Fy", "Fz", "Tz")), target=(10.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    ),
}
"""Questions of pages, by what is special about them."""


@pytest.mark.parametrize("name", STATES)
def test_a_script_prints_the_answer_of_the_page(name: str, tmp_path: Path) -> None:
    state = STATES[name]
    solver = Solver()
    script = script_of(state, solver.checkpoint_of(state))
    assert len(script.splitlines()) < 15
    if files.shipped_name(state.layout) is None:
        file, content = files.layout_file(state.layout)
        (tmp_path / file).write_bytes(content)
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    printed = run.stdout.splitlines()
    answer = solver.reply(state).answer
    np.testing.assert_allclose(
        np.array(json.loads(printed[-1].replace("nan", "NaN"))), answer.command, atol=1e-9
    )
    assert f"power {answer.power:.3f} W" in run.stdout, "as the status line says it"


def test_a_robot_that_is_shipped_but_for_free_axes_is_opened_by_its_name() -> None:
    assert "free=('Tx', 'Ty')" in script_of(STATES["freed"])
    assert "load_layout('bluerov2_heavy')" in script_of(STATES["freed"])
    assert "free=" not in script_of(STATES["own and freed"]), "its file says so"


def test_the_checkpoint_is_that_which_answers() -> None:
    solver = Solver()
    assert solver.checkpoint_of(STATES["mdn"]) is None
    assert solver.checkpoint_of(State(UCAT, method="paper")) is None
    folder = resolve_checkpoint("default")
    own = Solver(folder)
    assert own.checkpoint_of(STATES["mdn"]) == str(folder)
    assert own.checkpoint_of(STATES["qp"]) is None
    assert f"'mdn', checkpoint={str(folder)!r}" in script_of(STATES["mdn"], str(folder))
