"""The runtime: the library's answers, without the library's weight."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocator
from finlab.assets import shipped_layouts
from finlab.deploy.bundle import NETWORK, Bundle, make_bundle
from finlab.deploy.bundle_file import parse_bundle
from finlab.deploy.command import main
from finlab.deploy.metadata import settings_of
from finlab.deploy.onnx.reading import read_model
from finlab.deploy.parity import answer_again, difference, random_cases
from finlab.deploy.runtime import Runtime
from finlab.deploy.self_check import self_check
from finlab.errors import DataError, FinlabError
from finlab.physics.energy import POWER_WEIGHTS

HEAVY = ("torch", "scipy", "viser", "matplotlib", "yaml", "safetensors", "tyro", "tqdm", "threadpoolctl")
WRENCH = ["--wrench", "1", "0", "0.5", "0", "0", "0.1"]


@pytest.fixture(scope="module")
def runtime(bundle: Bundle) -> Runtime:
    return Runtime(parse_bundle(bundle.files))


@pytest.fixture(scope="module")
def folder(bundle: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bundle") / "A"
    bundle.write(path)
    return path


@pytest.mark.parametrize(("engine", "most"), [("numpy", 0), ("onnx", 1)])
def test_answers_are_the_librarys(engine: str, most: int, bundle: Bundle) -> None:
    """All cases by numpy. onnxruntime rounds otherwise, which may tip an answer now and then."""
    runtime = Runtime(parse_bundle(bundle.files), engine)
    apart = [difference(answer_again(runtime, case), case.command) for case in random_cases(150)]
    assert sum(value > 1e-4 for value in apart) <= most


def test_answer_says_what_is_missing(runtime: Runtime) -> None:
    answer = runtime.allocate([1, 0, 0.5, 0, 0, 0.1], failed=["front_right"])
    assert answer.fins == finlab.load_layout(shipped_layouts()["A"]).names
    assert np.isnan(answer.command[0]).all() and not np.isnan(answer.command[1:]).any()
    np.testing.assert_allclose(answer.wrench + answer.unallocated, [1, 0, 0.5, 0, 0, 0.1], atol=1e-12)
    far = runtime.allocate([90, 0, 0, 0, 0, 0], policy="direction")
    assert far.err_norm > 1 and abs(far.wrench[1]) < 0.1
    with pytest.raises(FinlabError, match="no fin 'nobody'"):
        runtime.allocate([0] * 6, failed=["nobody"])


def test_failed_fins_of_the_bundle_stay_failed(shipped_allocator: Allocator) -> None:
    layout = finlab.load_layout(shipped_layouts()["A"])
    robot = Runtime(parse_bundle(make_bundle(layout, shipped_allocator, ("back_left",)).files))
    lost = layout.index("back_left")
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0]).command[lost]).all()
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0], failed=["front_left"]).command[lost]).all()
    assert np.isnan(robot.neutral()[lost]).all()
    assert all(finding.good for finding in self_check(robot))


def test_fast_path_reaches_the_target(bundle: Bundle) -> None:
    robot = Runtime(parse_bundle(bundle.files), fast=True)
    answer = robot.allocate([1, 0, 0.5, 0, 0, 0.1])
    assert answer.err_norm < 5e-3
    assert robot.energy(answer.command) == pytest.approx(answer.energy)
    assert all(finding.good for finding in self_check(robot))


@pytest.mark.parametrize("name", sorted(shipped_layouts()))
def test_every_shipped_layout_passes_its_self_test(name: str, shipped_allocator: Allocator) -> None:
    files = make_bundle(finlab.load_layout(shipped_layouts()[name]), shipped_allocator).files
    findings = self_check(Runtime(parse_bundle(files)))
    assert len(findings) == 7
    assert all(finding.good and finding.value == finding.value for finding in findings), findings


def test_self_test_notices_other_physics(bundle: Bundle) -> None:
    robot = parse_bundle(bundle.files)
    bent = {key: array * 1.05 for key, array in robot.weights.surrogate.items()}
    other = replace(robot, weights=replace(robot.weights, surrogate=bent))
    findings = self_check(Runtime(other))
    assert not all(finding.good for finding in findings)


def test_energy_weights_travel() -> None:
    layout = finlab.load_layout(shipped_layouts()["octo"])
    desk = finlab.load_allocator(energy_weights=POWER_WEIGHTS)
    robot = Runtime(parse_bundle(make_bundle(layout, desk).files))
    wrench = [1, 0, 0.5, 0, 0, 0.1]
    np.testing.assert_array_equal(robot.allocate(wrench).command, desk.allocate(layout, wrench).command)


def test_unknown_engine_and_settings_are_refused(bundle: Bundle) -> None:
    robot = parse_bundle(bundle.files)
    with pytest.raises(DataError, match="engine: expected one of numpy, onnx, got 'magic'"):
        Runtime(robot, "magic")
    model = read_model(bundle.files[NETWORK])
    written = json.loads(model.metadata["settings"])
    for settings, message in (
        ("[]", "settings must be"),
        (json.dumps(dict(written, n_candidates=10**9)), "must lie within 0..4096"),
        (json.dumps(dict(written, subsets=3)), "subsets must be true or false"),
    ):
        forged = replace(model, metadata={**model.metadata, "settings": settings})
        with pytest.raises(DataError, match=message):
            settings_of(forged, "x")


def test_nothing_heavy_is_loaded(folder: Path) -> None:
    code = (
        "import sys\n"
        f"for name in {HEAVY!r}: sys.modules[name] = None\n"
        "from finlab.deploy.command import main\n"
        f"assert main(['check', {str(folder)!r}]) == 0\n"
        f"assert main(['allocate', {str(folder)!r}, '--fast', *{WRENCH!r}]) == 0\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_command_allocates_and_checks(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(folder)]) == 0
    assert "this computer answers as the one that made the bundle" in capsys.readouterr().out
    assert main(["allocate", str(folder), *WRENCH, "--failed", "front_right", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    layout = finlab.load_layout(shipped_layouts()["A"])
    truth = finlab.load_allocator().allocate(layout, [1, 0, 0.5, 0, 0, 0.1], failed=["front_right"])
    assert values["command"][0] is None and values["failed"] == ["front_right"]
    np.testing.assert_allclose(values["command"][1:], truth.command[1:], atol=1e-9)
    assert main(["allocate", str(folder), *WRENCH]) == 0
    assert "front_left" in capsys.readouterr().out
    assert main(["check", "nowhere"]) == 2
    assert capsys.readouterr().err.startswith("finlab-runtime: error: nowhere: cannot be read")
