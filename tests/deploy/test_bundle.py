"""Bundles: the same bytes every time, read back whole, and refused once anything in them was changed."""

import hashlib
import io
import json
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocator
from finlab.assets import checkpoint_path
from finlab.bundle_files import ABOUT, CHECKSUMS, GRAPH, LARGEST, README, checksums, read_bundle_files
from finlab.cli import main
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.robot import load_robot, parse_robot
from finlab.errors import AllocationError, DataError, FinlabError
from finlab.physics.energy import POWER_WEIGHTS

WEIGHTS = "checkpoint/model.safetensors"


def resealed(files: dict[str, bytes]) -> dict[str, bytes]:
    """Files with checksums that fit them, as a careful forger would leave them."""
    rest = {name: content for name, content in files.items() if name != CHECKSUMS}
    return rest | {CHECKSUMS: checksums(rest)}


def test_folder_and_archive_hold_the_same_and_come_back(bundle: Bundle, tmp_path: Path) -> None:
    bundle.write(tmp_path / "A")
    bundle.write_zip(tmp_path / "A.zip")
    for place in (tmp_path / "A", tmp_path / "A.zip"):
        assert read_bundle_files(place) == dict(bundle.files)
        assert finlab.load_layout(place) == finlab.load_layout(str(place)) == finlab.load_layout("A")
        assert load_robot(place).layout == finlab.load_layout("A")
    bundle.write(tmp_path / "A")  # an earlier bundle is replaced
    assert sorted(path.name for path in tmp_path.iterdir()) == ["A", "A.zip"], "nothing else is left behind"


def test_the_library_reads_it(bundle: Bundle, shipped_allocator: Allocator, tmp_path: Path) -> None:
    bundle.write(tmp_path / "A")
    bundle.write_zip(tmp_path / "A.zip")
    layout, wrench = finlab.load_layout("A"), [1, 0, 0.5, 0, 0, 0.1]
    truth = shipped_allocator.allocate(layout, wrench).command
    for allocator in (
        finlab.load_allocator(tmp_path / "A"),
        finlab.load_allocator(str(tmp_path / "A.zip")),
        finlab.load_allocator("learned", checkpoint=tmp_path / "A"),
        finlab.load_allocator(checkpoint=tmp_path / "A" / "checkpoint"),
    ):
        np.testing.assert_array_equal(allocator.allocate(layout, wrench).command, truth)
    assert finlab.load_allocator(tmp_path / "A").checkpoint == "default"
    assert finlab.load_allocator("fast", checkpoint=tmp_path / "A.zip").name == "fast"
    sqp = finlab.load_allocator("sqp", checkpoint=tmp_path / "A.zip")
    np.testing.assert_array_equal(sqp.normalization.std, shipped_allocator.normalization.std)
    with pytest.raises(AllocationError, match="method: expected one of"):
        finlab.load_allocator(tmp_path / "A", checkpoint="default")
    with pytest.raises(AllocationError, match="method: expected one of .* got 'nowhere'"):
        finlab.load_allocator("nowhere")


def test_the_command_line_takes_a_bundle_with_its_lost_fins(
    shipped_allocator: Allocator, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make_bundle(finlab.load_layout("A"), shipped_allocator, ("back_left",)).write_zip(tmp_path / "A.zip")
    robot = str(tmp_path / "A.zip")
    line = ["allocate", robot, "--checkpoint", robot, "--wrench", "1", "0", "0.5", "0", "0", "0", "--json"]
    assert main(line) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["failed"] == ["back_left"] and values["checkpoint"] == "default"


def test_settings_travel_and_can_be_changed(tmp_path: Path) -> None:
    desk = finlab.load_allocator(n_candidates=32, temperature=0.5, energy_weights=POWER_WEIGHTS)
    make_bundle(finlab.load_layout("octo"), desk).write(tmp_path)
    assert finlab.load_allocator(tmp_path).options == desk.options
    assert finlab.load_allocator(tmp_path, n_candidates=8).options == desk.options | {"n_candidates": 8}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"settings": []}, "settings must be keys and values"),
        ({"settings": {"n_candidates": 3}}, "settings must be n_candidates, "),
        ({"n_candidates": 10**9}, "n_candidates must lie within 0..4096"),
        ({"subsets": 3}, "subsets must be true or false"),
        ({"temperature": "warm"}, "temperature must lie within"),
        ({"energy_weights": {"amplitude": 1.0}}, "energy_weights must be amplitude, "),
        ({"version": 3}, "bundle version 3, this finlab reads version 2; export it again"),
        ({"version": 1}, "bundle version 1, this finlab reads version 2; export it again"),
        ({"format": "other"}, "expected format finlab-bundle"),
        ({"checkpoint": 7}, "checkpoint must be a name"),
    ],
)
def test_settings_no_robot_should_try_are_refused(
    change: dict[str, object], message: str, bundle: Bundle
) -> None:
    document = json.loads(bundle.files[ABOUT])
    place = document if set(change) & set(document) else document["settings"]
    place.update(change)
    with pytest.raises(DataError, match=message):
        parse_robot(resealed({**bundle.files, ABOUT: json.dumps(document).encode()}))


def test_weights_are_those_of_the_checkpoint(bundle: Bundle) -> None:
    for name in ("config.json", "model.safetensors", "fast/model.safetensors"):
        assert bundle.files[f"checkpoint/{name}"] == (checkpoint_path() / name).read_bytes()


def test_version_1_is_refused_with_the_way_out(bundle: Bundle, tmp_path: Path) -> None:
    old = {GRAPH: bundle.files[GRAPH], "network.onnx": b"", "surrogate.onnx": b"", README: b""}
    (tmp_path / "old").mkdir()
    for name, content in old.items():
        (tmp_path / "old" / name).write_bytes(content)
    archive_of(tmp_path / "old.zip", **old)
    for place in ("old", "old.zip"):
        for read in (finlab.load_allocator, finlab.load_layout, load_robot):
            with pytest.raises(DataError, match="version 1, .* export it again with `finlab export"):
                read(tmp_path / place)
    # What the sentence says works.
    assert main(["export", str(tmp_path / "old" / GRAPH), "-o", str(tmp_path / "new")]) == 0
    assert load_robot(tmp_path / "new").layout == finlab.load_layout("A")


def test_same_input_same_bytes(bundle: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    again = make_bundle(finlab.load_layout("A"), finlab.load_allocator())
    assert again.zip_bytes() == bundle.zip_bytes()
    assert main(["export", "A", "-o", str(tmp_path / "robot"), "--zip"]) == 0
    assert (tmp_path / "robot.zip").read_bytes() == bundle.zip_bytes()
    assert main(["export", "A", "-o", str(tmp_path / "robot")]) == 0
    assert "finlab-runtime check robot" in capsys.readouterr().out
    for name, content in bundle.files.items():
        assert (tmp_path / "robot" / name).read_bytes() == content


def test_checksums_are_those_of_sha256sum(bundle: Bundle) -> None:
    for line in bundle.files[CHECKSUMS].decode().splitlines():
        digest, name = line.split("  ")
        assert hashlib.sha256(bundle.files[name]).hexdigest() == digest


def test_readme_runs_it_in_five_lines(bundle: Bundle) -> None:
    text = bundle.files[README].decode()
    lines = text.split("```\n")[1].strip().splitlines()
    assert len(lines) == 5 and any("finlab-runtime check" in line for line in lines)
    assert "front_right" in text and finlab.__version__ in text


def test_archive_is_plain(bundle: Bundle) -> None:
    with zipfile.ZipFile(io.BytesIO(bundle.zip_bytes())) as archive:
        assert archive.testzip() is None
        for entry in archive.infolist():
            assert entry.date_time == (1980, 1, 1, 0, 0, 0) and entry.compress_type == zipfile.ZIP_STORED


@pytest.mark.parametrize("name", LARGEST)
def test_a_changed_file_is_named(name: str, bundle: Bundle) -> None:
    content = bytearray(bundle.files[name])
    content[len(content) // 2] ^= 1
    with pytest.raises(FinlabError, match=f"{name if name != CHECKSUMS else ''}.* does not fit SHA256SUMS"):
        parse_robot({**bundle.files, name: bytes(content)})


def test_forged_weights_are_refused_although_their_checksum_fits(bundle: Bundle) -> None:
    name = "checkpoint/model.safetensors"
    content = bytearray(bundle.files[name])
    content[-1] ^= 1
    with pytest.raises(FinlabError, match="its SHA-256 is not the one in config.json"):
        parse_robot(resealed({**bundle.files, name: bytes(content)}))


def test_parts_of_two_exports_are_refused(bundle: Bundle, untrained_checkpoint: Path) -> None:
    other = make_bundle(finlab.load_layout("A"), finlab.load_allocator(checkpoint=untrained_checkpoint))
    mixed = {**bundle.files, GRAPH: other.files[GRAPH]}
    with pytest.raises(DataError, match="are of different checkpoints"):
        parse_robot(resealed(mixed))


def archive_of(path: Path, **files: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda p: p / "nowhere", "cannot be read: No such file"),
        (lambda p: p, "layout.graph.json is missing; a bundle is made by `finlab export"),
        (lambda p: archive_of(p / "a.zip", **{"../evil": b"x"}), "'../evil', which is no part of a bundle"),
        (lambda p: archive_of(p / "a.zip", **{GRAPH: b" " * 2_000_000}), "larger than 1,000,000 bytes"),
        (lambda p: archive_of(p / "a.zip", **{WEIGHTS: bytes(50_000_001)}), "larger than 50,000,000 bytes"),
    ],
    ids=["missing", "empty", "path out of the archive", "large graph", "zip bomb"],
)
def test_what_is_no_bundle_is_refused(make: Callable[[Path], Path], message: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=message):
        load_robot(make(tmp_path))


def test_a_link_in_a_folder_is_refused(bundle: Bundle, tmp_path: Path) -> None:
    bundle.write(tmp_path)
    (tmp_path / WEIGHTS).unlink()
    os.symlink("/dev/zero", tmp_path / WEIGHTS)
    with pytest.raises(DataError, match="model.safetensors is no regular file"):
        load_robot(tmp_path)


def test_a_folder_with_other_things_is_not_written_to(bundle: Bundle, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(DataError, match="holds 'thesis.tex', which is no part of a bundle"):
        bundle.write(tmp_path)


def test_methods_that_do_not_travel_are_refused() -> None:
    with pytest.raises(AllocationError, match="method 'sqp' cannot be exported"):
        make_bundle(finlab.load_layout("A"), finlab.load_allocator("sqp"))


def test_fins_that_the_networks_do_not_know_are_refused(
    shipped_allocator: Allocator, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(AllocationError, match="has not learned the fins .* so the robot would answer"):
        make_bundle(finlab.load_layout("mixed"), shipped_allocator)
    for output in ("robot", "robot.graph.json"):
        assert main(["export", "mixed", "-o", str(tmp_path / output)]) == 2
        assert "has not learned the fins" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_export_refuses_names_that_are_neither(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "A", "-o", "A.graph.json", "--zip"]) == 2
    assert "a graph file alone is not zipped" in capsys.readouterr().err
    assert main(["export", "A", "-o", "A", "--zip", "--onnx"]) == 2
    assert "leave out --zip" in capsys.readouterr().err
    assert checkpoint_path().is_dir()
