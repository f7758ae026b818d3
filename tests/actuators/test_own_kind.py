"""The kind of actuator that docs/howto/kind.md makes: all of finlab takes it, and only that page
knows it."""

import importlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.actuators.kinds import KINDS, Kinds, import_kinds
from finlab.allocation import Allocator
from finlab.deploy.command import main as runtime
from finlab.errors import FinlabError
from finlab.layout import Damage, Layout, load_layout, save_layout
from finlab.physics import plant_of
from tests.webapp.test_faults import Tab
from webapp.panels.inspectors import inspector_of
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the page's block as the module `water_jet`, which is imported and known."""
    folder = tmp_path_factory.mktemp("kind")
    blocks = re.findall(
        r"```python.*?\n(.*?)```", (ROOT / "docs/howto/kind.md").read_text(), re.DOTALL
    )
    (folder / "water_jet.py").write_text(
        next(block for block in blocks if "class WaterJet" in block)
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        importlib.import_module("water_jet")
        yield folder
    del sys.modules["water_jet"], KINDS["water_jet"]


@pytest.fixture(scope="module")
def boat(home: Path) -> Layout:
    """Two water jets astern, for surge and yaw, of the page's kind; `home` is its folder."""
    jets = [(f"jet_{side}", (-0.6, y, 0.0)) for side, y in (("left", 0.3), ("right", -0.3))]
    parts = tuple(KINDS["water_jet"](n, p, (0, 0, 1), (1, 0, 0)) for n, p in jets)  # type: ignore[call-arg]
    return Layout("jetboat", parts, axes=("Fx", "Tz"))


def test_it_is_answered_in_and_out_of_reach_and_damaged(boat: Layout) -> None:
    allocator = Allocator(boat)
    plant = plant_of(boat)
    for surge, yaw in ((10.0, 1.0), (25.0, -3.0), (5.0, 0.0)):
        answer = allocator.allocate([surge, 0, 0, 0, 0, yaw])
        np.testing.assert_allclose(plant.wrench(answer.command)[[0, 5]], (surge, yaw), atol=1e-6)
        assert answer.err_norm < 1e-6 and answer.bound is not None
        # Its watts by the page's own law: 2 F^2 of each.
        assert answer.power == pytest.approx(2.0 * (answer.command[:, 1] ** 2).sum(), rel=1e-9)
        assert answer.bound <= answer.power <= answer.bound * (1 + 1e-6)
    out_of_reach = allocator.allocate([100, 0, 0, 0, 0, 0])
    assert out_of_reach.wrench[0] == pytest.approx(40.0, abs=1e-6) and "at full thrust" in str(
        out_of_reach
    )
    weak = allocator.allocate([100, 0, 0, 0, 0, 0], damage=Damage(weak={"jet_left": 0.5}))
    assert weak.command[:, 1] == pytest.approx([10.0, 20.0], abs=1e-6)
    assert "water_jet" in str(weak) and weak.commands["jet_left"].force == pytest.approx(10.0)
    mirrored = boat.actuator("jet_left").image()
    assert mirrored.position == boat.actuator("jet_right").position and mirrored.value("arc") == (
        -1.0,
        1.0,
    )


def test_the_command_line_and_the_runtime_take_it(
    home: Path, boat: Layout, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "boat.yaml"
    save_layout(boat, robot)
    assert load_layout(robot) == boat
    steps = [
        ["layout", "show", robot],
        ["allocate", robot, "--wrench", 10, 0, 0, 0, 0, 1, "--weak", "jet_left=0.5"],
        [
            "layout",
            "optimize",
            robot,
            "--actuators",
            *boat.names,
            "--rounds",
            1,
            "-o",
            tmp_path / "b.yaml",
        ],
        ["simulate", robot, "--trajectory", "circle", "--duration", 12, "-o", tmp_path / "swim"],
        ["export", robot, "-o", tmp_path / "bundle", "--graph", tmp_path / "boat.json"],
        ["layout", "convert", robot, tmp_path / "boat.urdf"],
    ]
    script = "import sys, json; from finlab.cli import main\n"
    script += (
        "if __name__ == '__main__': sys.exit(any([main(step) for step in json.loads(sys.argv[1])]))"
    )
    (tmp_path / "steps.py").write_text(script)
    text = json.dumps([list(map(str, step)) for step in steps])
    path = os.pathsep.join((str(home), str(ROOT)))
    environment = {**os.environ, "PYTHONPATH": path, "FINLAB_KINDS": "water_jet"}
    subprocess.run(
        [sys.executable, tmp_path / "steps.py", text], env=environment, check=True, timeout=120
    )
    printed = capfd.readouterr().out
    assert (
        "2 water_jets push in 2 of 2 independent directions" in printed and "delivered" in printed
    )
    assert load_layout(tmp_path / "boat.json") == boat
    assert "jet_left" in (tmp_path / "boat.urdf").read_text()
    assert runtime(["check", str(tmp_path / "bundle")]) == 0


def test_the_app_shows_and_edits_it(boat: Layout, capsys: pytest.CaptureFixture[str]) -> None:
    pools = Pools()
    tab = Tab(pools, boat, Solver())
    session = tab.view.session
    tab.on_loop(lambda: tab.view.do(lambda: session.add("water_jet")))
    name: Any = session.selected
    tab.on_loop(lambda: tab.view.do(lambda: session.set_value("force", (0.0, 10.0))))
    tab.on_loop(lambda: tab.view.do(lambda: session.point_selected((0.0, 1.0, 0.0))))
    tab.on_loop(lambda: tab.view.do(lambda: session.damage(name, "weak", 0.5)))
    tab.on_loop(lambda: tab.view.do(lambda: session.set_target(0, 3.0)))
    tab.settle()
    part = session.state.layout.actuator(name)
    assert part.value("force") == (0.0, 10.0) and part.direction == pytest.approx((0.0, 1.0, 0.0))
    assert session.state.able.actuator(name).upper[1] == pytest.approx(5.0)
    # Its inspector is made of its fields, since it has none of its own.
    boxes = {box.label: box for box in inspector_of(type(part)).limits}
    assert {*boxes} == {"Arc [°]", "Force [N]"} and boxes["Arc [°]"].degrees
    assert inspector_of(type(part)).other_axis == "Zero"
    shown = " ".join(tab.figures())
    assert tab.client.notes == [] and "Traceback" not in capsys.readouterr().err
    assert "water_jet" in shown and "Exact" in shown and "cannot be shown" not in shown
    tab.close()
    pools.stop()


def test_all_kinds_keep_the_contract() -> None:
    again = Kinds({})
    for name, kind in KINDS.items():
        again[name] = kind
    assert again == KINDS


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (
            "from finlab.actuators.kinds import KINDS",
            "import no_such_module",
            "No module named 'no_such_module'",
        ),
        ("return price / 4", "return price / (4", "SyntaxError"),
        ('    type = "water_jet"\n', '    type = "water_jet"\n    1 / 0\n', "ZeroDivisionError"),
        (
            "        law=AzimuthLaw,\n        group=AzimuthGroup,\n",
            "",
            "missing 2 required keyword-only arguments: 'law' and 'group'",
        ),
        ("    KIND = Kind(", "    OTHER = Kind(", "WaterJet lacks KIND"),
        ("    KIND = Kind(", "    KIND = dict(", "KIND of WaterJet: expected a Kind, got {"),
        ("command=JetCommand", "command=()", "command of WaterJet: expected a subclass of Command"),
        (
            "    def damaged(self, faults):",
            "    def hurt(self, faults):",
            "WaterJet lacks damaged()",
        ),
        ("    def sample(cls):", "    def other(cls):", "WaterJet lacks sample()"),
        ("    position: Place\n", "", "WaterJet lacks position"),
        ('limits="force"', 'limits="push"', "the field 'push' of its KIND (limits of 'force')"),
        (', limits="force"', "", "WaterJet lacks limits of its number 'force'"),
        ('limits="force"', 'limits="force", rate="ramp"', "the field 'ramp' of its KIND"),
        ('axes=("shaft", "zero")', 'axes=("shaft", "bow")', "the field 'bow' of its KIND (axes)"),
        ('pointed="shaft"', 'pointed="bow"', "pointed of WaterJet: expected one of shaft, zero"),
        ('("zero", ACROSS)', '("bow", ACROSS)', "pushes_along of WaterJet: expected one of shaft"),
        ('"pod"', '"boat"', "expected one of fin, thruster, pod, foil, got 'boat'"),
        ('("weak",)', '("tired",)', "got 'tired'"),
        ("group=AzimuthGroup", "group=Pump", "a subclass of Group, got"),
        ("@dataclass(frozen=True)\nclass WaterJet", "class WaterJet", "WaterJet is no dataclass"),
        ("KINDS[WaterJet.type] = WaterJet", "KINDS['jet'] = WaterJet", "has the type 'water_jet'"),
        (
            "KINDS[WaterJet.type] = WaterJet",
            "KINDS['jet'] = Pump()",
            "expected a subclass of Actuator",
        ),
    ],
)
def test_a_module_of_kinds_that_is_none_is_one_sentence(
    before: str, after: str, said: str, home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (home / "water_jet.py").read_text()
    assert before in text
    (tmp_path / "jet_of_mine.py").write_text(text.replace(before, after))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "jet_of_mine", raising=False)
    kinds = dict(KINDS)
    with pytest.raises(FinlabError, match="^FINLAB_KINDS: ") as caught:
        import_kinds("jet_of_mine")
    sentence = str(caught.value)
    assert "jet_of_mine" in sentence and said in sentence and "\n" not in sentence
    assert kinds == KINDS


def test_a_module_of_kinds_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "FINLAB_KINDS": "nowhere"}
    for module in ("finlab", "finlab.deploy.command"):
        verb = ["layout", "check", "A"] if module == "finlab" else ["check", str(tmp_path)]
        ask = [sys.executable, "-m", module, *verb]
        done = subprocess.run(ask, env=environment, capture_output=True, text=True, timeout=60)
        assert done.returncode == 2 and done.stderr.count("\n") == 1
        assert "FINLAB_KINDS: the module 'nowhere' cannot be imported" in done.stderr
    script = (
        "import finlab\ntry: finlab.load_layout\nexcept finlab.errors.FinlabError as error: "
        "print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", "import finlab.errors\n" + script],
        env=environment,
        capture_output=True,
    )
    assert done.returncode == 0 and b"nowhere" in done.stdout


def test_only_the_page_knows_it() -> None:
    sources = [*(ROOT / "finlab").rglob("*.py"), *(ROOT / "webapp").rglob("*.py")]
    assert not [
        path for path in sources if re.search(r"water_?jet", path.read_text(), re.IGNORECASE)
    ]
