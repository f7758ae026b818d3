"""Proofs by boxes: what the checker accepts holds, and what is false is refused."""

import json
import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.analysis import check_proof
from finlab.analysis.prove import ProofResult, box_share, prove
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.errors import CommandError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.interaction.jets import Jets
from finlab.layout import Layout
from tests.analysis.proof_oracle import is_true
from tests.random_robots import KINDS, load, random_robot

ROBOTS_PER_KIND = int(os.environ.get("FINLAB_PROOF_ROBOTS", "0"))
"""Random robots of each kind; 20 are two hundred. By default one each of those that are quick."""
SLOW = ("mixed", "all")
"""Kinds with many actuators."""
CHANGED_FILES = int(os.environ.get("FINLAB_PROOF_CHANGES", "60"))
"""Files with one digit changed; a thousand say more."""
SHARE = 0.6


def settled(result: ProofResult) -> str:
    """The verdict of a result, whose file the checker reads as a stranger would."""
    assert result.verdict in ("proved", "refuted"), result.reason
    assert check_proof.check(json.dumps(result.proof)).startswith(result.verdict)
    return result.verdict


def box_of(layout: Layout) -> list[float]:
    """60 % of what each axis can alone; of one that can nothing alone, of a third of what its
    actuators can together."""
    try:
        return list(box_share(layout, SHARE))
    except CommandError:
        sets = force_sets(layout)
        together = np.abs(sets.full_effectiveness()[0]).sum(axis=0) * SCALE
        return list(SHARE / 3.0 * together * layout.commanded)


def verdicts(layout: Layout) -> list[str]:
    """Verdicts of the box of a share, and of the same share of the largest box of that shape."""
    box = box_of(layout)
    result = prove(layout, box)
    found = [settled(result)]
    if result.largest_share is not None and result.largest_share > 1e-9:
        smaller = [SHARE * result.largest_share * half for half in box]
        found.append(settled(prove(layout, smaller)))
    return found


@pytest.mark.parametrize("name", shipped_layouts())
def test_shipped_robots_are_settled(name: str) -> None:
    """Each box of each shipped robot is proved or refuted."""
    found = verdicts(finlab.load_layout(name))
    assert len(found) == 1 or found[1] == "proved"


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "slipstreams"])
def test_random_robots_are_settled(kind: str) -> None:
    """So is that of random robots, with rudders at rest, wide arcs and fins that cannot rest;
    rudders in slipstreams are refused, see `test_propeller_rudder.py`."""
    for number in range(ROBOTS_PER_KIND or (kind not in SLOW)):
        assert verdicts(load(random_robot(kind, number, 63)))


def test_two_losses_and_free_axes() -> None:
    """With two lost there are all pairs; a free axis makes room."""
    heavy = finlab.load_layout("bluerov2_heavy")
    box = [10, 10, 10, 0, 0, 0]
    two = prove(heavy, box, lost=2)
    assert settled(two) == "refuted"
    freed = prove(heavy, box, lost=1, free=("Tx", "Ty"))
    assert settled(freed) == "proved"
    assert freed.n_cases == 9
    assert freed.n_corners == 8


def test_power_budget_agrees_with_the_least_power() -> None:
    """Around the least power of the dearest corner the verdict turns."""
    for name, box in (
        ("bluerov2_heavy", [20, 20, 0, 0, 0, 2]),
        ("no_yaw", [1, 1, 2, 0, 0, 0]),
        ("catamaran", [10, 5, 0, 0, 0, 4]),
    ):
        layout = finlab.load_layout(name)
        allocator = finlab.Allocator(layout)
        watts = 0.0
        for lost in ((), *((actuator,) for actuator in layout.names)):
            corners = np.array(np.meshgrid(*([-1, 1],) * 6)).reshape(6, -1).T * box
            watts = max(watts, float(allocator.allocate_batch(corners, lost=lost).power.max()))
        assert settled(prove(layout, box, power=1.02 * watts)) == "proved"
        assert settled(prove(layout, box, power=0.95 * watts)) == "refuted"


def test_what_is_not_certain_is_not_settled() -> None:
    """An interaction, and a file of measured forces, give the reason."""
    layout = finlab.load_layout("A")
    with_jets = Layout("jets", layout.actuators, interaction=Jets())
    result = prove(with_jets, [1, 1, 1, 0.1, 0.1, 0.1])
    assert result.verdict == "not settled"
    assert "interaction" in result.reason
    assert result.proof is None


@pytest.mark.parametrize(
    ("box", "options", "words"),
    [
        ([1, 1, 1, 1, 1], {}, "six half widths"),
        ([1, 1, 1, 1, -1, 1], {}, "six half widths"),
        ([0, 0, 0, 0, 0, 0], {}, "above 0"),
        ([0, 0, 0, 0, 1, 0], {}, "Ty is free"),
        ([1, 1, 1, 0, 0, 1], {"lost": 9}, "lost"),
        ([1, 1, 1, 0, 0, 1], {"power": -1.0}, "power"),
        ([1, 1, 1, 0, 0, 1], {"free": ("Tq",)}, "Tq"),
    ],
)
def test_statements_that_are_none(box: Any, options: Any, words: str) -> None:
    """Errors say what was expected."""
    with pytest.raises(CommandError, match=words):
        prove(finlab.load_layout("bluerov2"), box, **options)


@pytest.fixture(scope="module")
def files() -> list[str]:
    """Files of small robots: proved and refuted, with and without a budget."""
    texts = []
    questions: list[tuple[str, list[float], float | None]] = [
        ("no_yaw", [1, 1, 2, 0.1, 0.1, 0], None),
        ("no_yaw", [1, 1, 2, 0.1, 0.1, 0], 150.0),
        ("catamaran", [10, 5, 0, 0, 0, 4], 900.0),
        ("bluerov2_heavy", [20, 20, 0, 0, 0, 2], None),
        ("bluerov2_heavy", [60, 60, 20, 1, 1, 2], None),
        ("bluerov2_heavy", [20, 20, 20, 1, 1, 2], 400.0),
        ("catamaran", [10, 5, 0, 0, 0, 4], 2.0),
    ]
    for name, box, power in questions:
        result = prove(finlab.load_layout(name), box, power=power)
        settled(result)
        texts.append(json.dumps(result.proof))
    return texts


def test_files_with_a_changed_digit(files: list[str]) -> None:
    """Of files with one digit changed, all that are false are refused."""
    rng = random.Random(63)
    for text in files:
        assert is_true(text)
    n_refused = 0
    for number in range(CHANGED_FILES):
        text = files[number % len(files)]
        places = [i for i, letter in enumerate(text) if letter.isdigit()]
        place = rng.choice(places)
        digit = rng.choice([d for d in "0123456789" if d != text[place]])
        changed = text[:place] + digit + text[place + 1 :]
        try:
            check_proof.check(changed)
        except (check_proof.WrongProof, LookupError, TypeError, ValueError, ArithmeticError):
            n_refused += 1
        else:
            assert is_true(changed), f"{text[place - 40 : place]}[{text[place]} -> {digit}]"
    print(f"\nof {CHANGED_FILES} files {n_refused} are refused, the others are true")
    assert n_refused > CHANGED_FILES // 4


def test_the_checker_needs_python_alone(tmp_path: Path, files: list[str]) -> None:
    """A copy of it runs without numpy and finlab, and its exit code tells."""
    checker = tmp_path / "check_proof.py"
    checker.write_text(Path(check_proof.__file__).read_text("utf-8"), "utf-8")
    proof = tmp_path / "proof.json"
    proof.write_text(files[0], "utf-8")
    wrong = tmp_path / "wrong.json"
    wrong.write_text(files[0].replace('"lost": 1,', '"lost": 2,'), "utf-8")
    for path, code, words in ((proof, 0, "proved: any wrench"), (wrong, 1, "no case in which")):
        command = [sys.executable, "-I", "-S", str(checker), str(path)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (run.returncode, words in run.stdout) == (code, True), run.stdout + run.stderr


def test_the_verb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit codes tell the verdicts; text, JSON and files go together."""
    output = tmp_path / "proof.json"
    box = ["--box", "20", "20", "20", "1", "1", "2"]
    assert main(["layout", "prove", "bluerov2_heavy", *box, "-o", str(output)]) == 0
    assert "proved: bluerov2_heavy" in capsys.readouterr().out
    assert check_proof.main(output) == 0
    capsys.readouterr()
    assert main(["layout", "prove", "bluerov2_heavy", "--box-share", "0.6", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["verdict"] == "refuted"
    assert main(["layout", "prove", "A"]) == 2
    assert "--box" in capsys.readouterr().err
