"""Bundles: the same bytes every time, read back whole, and refused once anything in them was
changed."""

import hashlib
import json
import resource
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocator
from finlab.bundle_files import (
    CHECKPOINT_FOLDER,
    CHECKSUM_FILE,
    MANIFEST_FILE,
    ROBOT_FILE,
    TABLE_FOLDER,
    checksums,
    read_bundle_files,
    table_name,
)
from finlab.cli import main
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.command import main as runtime
from finlab.deploy.deployed_robot import load_robot, parse_robot
from finlab.errors import AllocationError, CheckpointError, DataError, FinlabError
from finlab.layout import Layout
from tests.allocator_cache import AllocatorCache

WRENCH = [1, 0, 0.5, 0, 0, 0.1]
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""


@pytest.fixture(scope="module")
def of_mdn() -> Bundle:
    """Layout A for method `mdn`."""
    return make_bundle(Allocator(finlab.load_layout("A"), "mdn"))


def resealed(files: dict[str, bytes]) -> dict[str, bytes]:
    """Files with checksums that fit them, as a careful forger would leave them."""
    rest = {name: content for name, content in files.items() if name != CHECKSUM_FILE}
    return rest | {CHECKSUM_FILE: checksums(rest)}


def edited(bundle: Bundle, name: str, change: Callable[[dict[str, Any]], Any]) -> dict[str, bytes]:
    """The files of a bundle after a change of one of JSON, resealed."""
    document = json.loads(bundle.files[name])
    change(document)
    return resealed({**bundle.files, name: json.dumps(document).encode()})


def test_folder_and_archive_hold_the_same_and_come_back(
    bundle: Bundle, shipped_allocator: AllocatorCache, tmp_path: Path
) -> None:
    truth = shipped_allocator.allocate(finlab.load_layout("A"), WRENCH)
    bundle.write(tmp_path / "A")
    bundle.write_zip(tmp_path / "A.zip")
    for place in (tmp_path / "A", tmp_path / "A.zip"):
        assert read_bundle_files(place) == dict(bundle.files)
        assert (
            finlab.load_layout(place) == finlab.load_layout(str(place)) == finlab.load_layout("A")
        )
        assert load_robot(place).layout == finlab.load_layout("A")
        assert Allocator.from_bundle(place).allocate(WRENCH) == truth
    bundle.write(tmp_path / "A")  # an earlier bundle is replaced
    assert sorted(path.name for path in tmp_path.iterdir()) == ["A", "A.zip"], (
        "nothing else is left behind"
    )


def test_the_method_with_networks_answers_with_those_of_this_finlab(
    of_mdn: Bundle, tmp_path: Path
) -> None:
    of_mdn.write(tmp_path)
    desk = Allocator(finlab.load_layout("A"), "mdn")
    assert Allocator.from_bundle(tmp_path).allocate(WRENCH) == desk.allocate(WRENCH)
    assert load_robot(tmp_path).allocate(WRENCH) == desk.allocate(WRENCH)


@pytest.mark.parametrize(
    ("method", "fixture", "archive"),
    [("mdn", "untrained_mdn", False), ("paper", "untrained_checkpoint", True)],
)
def test_networks_of_ones_own_travel(
    method: str, fixture: str, archive: bool, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    folder = tmp_path / "mine"
    shutil.copytree(request.getfixturevalue(fixture), folder)
    desk = Allocator(finlab.load_layout("A"), method, checkpoint=folder)
    truth = desk.allocate(WRENCH)
    place = tmp_path / ("A.zip" if archive else "A")
    line = ["export", "A", "-o", str(place), "--method", method, "--checkpoint", str(folder)]
    assert main([*line, "--zip"] if archive else line) == 0
    shutil.rmtree(folder)
    assert (
        Allocator.from_bundle(place).allocate(WRENCH) == truth == load_robot(place).allocate(WRENCH)
    )
    assert truth.checkpoint == "mine"
    again = make_bundle(Allocator.from_bundle(place))
    assert dict(again.files) == read_bundle_files(place)
    assert runtime(["check", str(place)]) == 0
    files = dict(again.files)
    weights = CHECKPOINT_FOLDER + "model.safetensors"
    for damaged in (files[weights][:-4], files[weights][:-4] + bytes(4)):
        with pytest.raises(
            CheckpointError, match="checkpoint/model.safetensors: its SHA-256 is not the one"
        ):
            parse_robot(resealed({**files, weights: damaged}))
    del files[CHECKPOINT_FOLDER + "config.json"]
    with pytest.raises(CheckpointError, match="checkpoint/config.json: no such file"):
        parse_robot(resealed(files))


def test_the_command_line_takes_a_bundle_with_its_lost_fins(
    shipped_allocator: AllocatorCache, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make_bundle(shipped_allocator.on(finlab.load_layout("A")), ("back_left",)).write_zip(
        tmp_path / "A.zip"
    )
    robot = str(tmp_path / "A.zip")
    line = ["allocate", robot, "--wrench", "1", "0", "0.5", "0", "0", "0", "--json"]
    assert main(line) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["lost"] == ["back_left"] and values["method"] == "dual"


def test_settings_travel(tmp_path: Path) -> None:
    desk = Allocator(finlab.load_layout("octo"), robust=0.5, period_s=0.05)
    make_bundle(desk).write(tmp_path)
    assert Allocator.from_bundle(tmp_path).settings == desk.settings


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"settings": []}, "settings must be keys and values"),
        (
            {"settings": {"n_tries": 3}},
            "settings: method 'dual' knows the settings .*, got 'n_tries'",
        ),
        ({"period_s": -1.0}, "period_s: expected a number"),
        ({"robust": float("nan")}, "holds NaN, expected a finite number"),
        (
            {"version": 4.0},
            "is a bundle of version 4.0, this finlab reads version 9; export it again",
        ),
        (
            {"version": "4"},
            "is a bundle of version '4', this finlab reads version 9; export it again",
        ),
        ({"version": 3}, "is a bundle of version 3, this finlab reads version 9; export it again"),
        ({"version": True}, "is a bundle of version True"),
        ({"format": "other"}, "expected format finlab-bundle"),
        ({"method": "sqp"}, "method must be one of dual, mdn, paper, got 'sqp'"),
        ({"method": "mdn", "settings": {}}, "was made with other networks than this finlab's"),
        (
            {"method": "mdn", "settings": {}, "checkpoint": "mine"},
            "'mine' is not among the shipped ones",
        ),
    ],
)
def test_settings_no_robot_should_try_are_refused(
    change: dict[str, object], message: str, bundle: Bundle
) -> None:
    files = edited(
        bundle,
        MANIFEST_FILE,
        lambda d: (d if set(change) & set(d) else d["settings"]).update(change),
    )
    with pytest.raises(FinlabError, match=message):
        parse_robot(files)


def test_checksums_are_those_of_sha256sum(bundle: Bundle) -> None:
    for line in bundle.files[CHECKSUM_FILE].decode().splitlines():
        digest, name = line.split("  ")
        assert hashlib.sha256(bundle.files[name]).hexdigest() == digest


def test_a_changed_file_is_named(measured_bundle: Bundle) -> None:
    files = measured_bundle.files
    for name in files:
        content = bytearray(files[name])
        content[len(content) // 2] ^= 1
        named = name if name != CHECKSUM_FILE else ""
        with pytest.raises(FinlabError, match=f"{named}.* does not fit SHA256SUMS"):
            parse_robot({**files, name: bytes(content)})


def test_other_networks_than_those_of_the_desk_are_refused(of_mdn: Bundle) -> None:
    other = edited(of_mdn, ROBOT_FILE, lambda d: d.update(weights_sha256="0" * 64))
    with pytest.raises(DataError, match="was made with other networks than this finlab's"):
        parse_robot(other)


def test_force_tables_travel_and_answer_from_folder_and_archive(
    measured: Layout,
    measured_bundle: Bundle,
    shipped_allocator: AllocatorCache,
    force_table: Path,
    tmp_path: Path,
) -> None:
    content = force_table.read_bytes()
    assert measured_bundle.files[table_name(content)] == content
    assert str(force_table.parent).encode() not in b"".join(measured_bundle.files.values()), (
        "no path leaks"
    )
    measured_bundle.write(tmp_path / "robot")
    measured_bundle.write_zip(tmp_path / "robot.zip")
    truth = shipped_allocator.allocate(measured, WRENCH, lost=["front_left"])
    for place in (tmp_path / "robot", tmp_path / "robot.zip"):
        layout = finlab.load_layout(place)
        path = Path(str(layout.fins[2].model.values()["path"]))
        assert path == place / table_name(content)
        answer = Allocator.from_bundle(place).allocate(WRENCH, lost=["front_left"])
        np.testing.assert_array_equal(answer.command, truth.command)
        np.testing.assert_array_equal(answer.wrench, truth.wrench)
        # And out of the bundle another one can be made.
        again = make_bundle(Allocator.from_bundle(place))
        assert again.zip_bytes() == measured_bundle.zip_bytes()


@pytest.mark.parametrize(
    "path", ["/etc/passwd", "../secret.csv", "tables/../../secret.csv", "secret.csv", ROBOT_FILE]
)
@pytest.mark.parametrize("archive", [False, True])
def test_a_force_table_outside_the_bundle_is_refused(
    path: str, archive: bool, measured_bundle: Bundle, tmp_path: Path
) -> None:
    (tmp_path / "secret.csv").write_text("A,f,phi,Fx,Fy,Fz\n")
    table = {"type": "table", "path": path}
    forged = Bundle(
        edited(
            measured_bundle, ROBOT_FILE, lambda d: d["layout"]["actuators"][2].update(model=table)
        )
    )
    place = tmp_path / ("x.zip" if archive else "x")
    (forged.write_zip if archive else forged.write)(place)
    for read in (finlab.load_layout, load_robot):
        with pytest.raises(
            FinlabError, match=r"model.path: names a force table that is not in the bundle"
        ):
            read(place)


def archive_of(path: Path, **files: bytes) -> Path:
    """Write files by their names into a zip archive."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda p: p / "nowhere", "no such file"),
        (lambda p: p, "robot.json is missing; a bundle is made by `finlab export"),
        (lambda p: archive_of(p / "a.zip", **{"../evil": b"x"}), "'../evil', which is no part of a bundle"),
        (lambda p: archive_of(p / "a.zip", **{ROBOT_FILE: bytes(1_000_001)}), "larger than 1,000,000 bytes"),
        (lambda p: archive_of(p / "a.zip", **{table_name(b"%d" % k): b"" for k in range(501)}), "than 500"),
        (lambda p: archive_of(p / "a.zip", **{f"{TABLE_FOLDER}../{'0' * 64}.csv": b""}), "is no part of a bundle"),
    ],
    ids=["missing", "empty", "out of the archive", "zip bomb", "tables", "out of tables"],
)  # fmt: skip
def test_what_is_no_bundle_is_refused(
    make: Callable[[Path], Path], message: str, tmp_path: Path
) -> None:
    with pytest.raises(DataError, match=message):
        load_robot(make(tmp_path))


@pytest.mark.parametrize("zipped", [False, True])
def test_a_full_disk_leaves_nothing_under_the_final_name(
    bundle: Bundle, tmp_path: Path, zipped: bool
) -> None:
    """Of a new bundle; an earlier one stays as it was."""

    def write(path: Path, parts: Bundle) -> None:
        (parts.write_zip if zipped else parts.write)(path)

    def held(path: Path) -> dict[str, bytes]:
        files = (file for file in path.rglob("*") if file.is_file())
        return {str(file.relative_to(path)): file.read_bytes() for file in files}

    large = Bundle({**bundle.files, MANIFEST_FILE: np.random.default_rng(0).bytes(300_000)})
    (tmp_path / "old").mkdir()
    write(tmp_path / "old" / "bundle", bundle)
    before = held(tmp_path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(
        resource.RLIMIT_FSIZE, (200_000, limits[1])
    )  # a file cannot be longer than that
    try:
        for name in ("new", "old/bundle"):
            with pytest.raises(DataError, match="cannot be written"):
                write(tmp_path / name, large)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert held(tmp_path) == before and not (tmp_path / "new").exists()
    write(tmp_path / "old" / "bundle", large)
    if not zipped:
        assert held(tmp_path / "old" / "bundle") == dict(large.files)


def test_a_folder_with_other_things_is_not_written_to(bundle: Bundle, tmp_path: Path) -> None:
    for name in ("zoo.txt", "thesis.tex", "well.txt"):
        (tmp_path / name).write_text("years of work")
    with pytest.raises(DataError, match="holds 'thesis.tex', which is no part of a bundle"):
        bundle.write(tmp_path)  # the first of them by name
    assert len(list(tmp_path.iterdir())) == 3


def test_methods_that_do_not_travel_are_refused() -> None:
    with pytest.raises(AllocationError, match="method 'sqp' cannot be exported"):
        make_bundle(Allocator(finlab.load_layout("A"), "sqp"))


def test_the_command_line_chooses_the_method(
    tmp_path: Path, of_mdn: Bundle, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "mixed", "-o", str(tmp_path / "mixed")]) == 0
    assert Allocator.from_bundle(tmp_path / "mixed").method == "dual"
    assert main(["export", "A", "-o", str(tmp_path / "A"), "--method", "mdn"]) == 0
    assert read_bundle_files(tmp_path / "A") == dict(of_mdn.files)
    capsys.readouterr()


def test_export_refuses_the_name_of_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "A", "-o", "A.json"]) == 2
    assert capsys.readouterr().err.startswith("finlab: error: A.json: expected a folder")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(surprise=1), "surprise: unknown key"),
        (lambda d: d.pop("layout"), "layout: required key is missing"),
        (lambda d: d.update(lost=["nobody"]), "no fin 'nobody'"),
        (lambda d: d["layout"].update(surprise=1), "layout: surprise: unknown key"),
        (lambda d: d["self_test"][0]["command"].pop(), r"self_test\[0\].command: expected 4 rows"),
        (
            lambda d: d["self_test"][0].pop("wrench"),
            r"self_test\[0\].wrench: required key is missing",
        ),
    ],
)
def test_a_robot_that_is_none_is_refused(
    change: Callable[[dict[str, Any]], None], message: str, bundle: Bundle
) -> None:
    with pytest.raises(FinlabError, match=message):
        parse_robot(edited(bundle, ROBOT_FILE, change))
