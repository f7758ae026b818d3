"""Bundles: the same bytes every time, read back whole, and refused once anything in them was changed."""

import hashlib
import io
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocator
from finlab.assets import checkpoint_path, shipped_layouts
from finlab.cli import main
from finlab.deploy.bundle import CHECKSUMS, FILES, GRAPH, NETWORK, README, Bundle, checksums, make_bundle
from finlab.deploy.bundle_file import parse_bundle, read_bundle
from finlab.errors import AllocationError, DataError, FinlabError


def resealed(files: dict[str, bytes]) -> dict[str, bytes]:
    """Files with checksums that fit them, as a careful forger would leave them."""
    rest = {name: content for name, content in files.items() if name != CHECKSUMS}
    return rest | {CHECKSUMS: checksums(rest)}


def test_folder_and_archive_hold_the_same_and_come_back(bundle: Bundle, tmp_path: Path) -> None:
    bundle.write(tmp_path / "A")
    bundle.write_zip(tmp_path / "A.zip")
    assert {path.name for path in (tmp_path / "A").iterdir()} == set(bundle.files) <= set(FILES)
    for place in ("A", "A.zip"):
        back = read_bundle(tmp_path / place)
        assert dict(back.files) == dict(bundle.files)
        assert back.graph.layout == finlab.load_layout(shipped_layouts()["A"])
    bundle.write(tmp_path / "A")  # an earlier bundle is replaced
    assert sorted(path.name for path in tmp_path.iterdir()) == ["A", "A.zip"], "nothing else is left behind"


def test_weights_come_back_to_the_last_bit(bundle: Bundle, shipped_allocator: Allocator) -> None:
    weights, truth = parse_bundle(bundle.files).weights, shipped_allocator.weights  # type: ignore[attr-defined]
    for part in ("network", "surrogate"):
        ours, theirs = getattr(weights, part), getattr(truth, part)
        assert set(ours) == set(theirs)
        assert all(np.array_equal(ours[key], theirs[key]) for key in theirs)
    assert all(np.array_equal(weights.fast.state[key], value) for key, value in truth.fast.state.items())
    ours, theirs = weights.check_network(), truth.check_network()
    assert (ours.heads, ours.n_components) == (theirs.heads, theirs.n_components)
    assert weights.fin_model == truth.fin_model and weights.name == "default"


def test_same_input_same_bytes(bundle: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    again = make_bundle(finlab.load_layout(shipped_layouts()["A"]), finlab.load_allocator())
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


@pytest.mark.parametrize("name", FILES)
def test_a_changed_file_is_named(name: str, bundle: Bundle) -> None:
    content = bytearray(bundle.files[name])
    content[len(content) // 2] ^= 1
    with pytest.raises(FinlabError, match=f"{name if name != CHECKSUMS else ''}.* does not fit SHA256SUMS"):
        parse_bundle({**bundle.files, name: bytes(content)})


def test_forged_network_is_refused_although_its_checksum_fits(bundle: Bundle) -> None:
    turned = bundle.files[NETWORK].replace(b"LeakyRelu", b"Sigmoid\0\0")
    with pytest.raises(DataError, match="network.onnx: uses the operator"):
        parse_bundle(resealed({**bundle.files, NETWORK: turned}))
    swapped = bundle.files[NETWORK].replace(b"Tanh", b"Relu")
    with pytest.raises(DataError, match="is not what this finlab writes for such weights"):
        parse_bundle(resealed({**bundle.files, NETWORK: swapped}))


def test_parts_of_two_exports_are_refused(bundle: Bundle, untrained_checkpoint: Path) -> None:
    other = make_bundle(
        finlab.load_layout(shipped_layouts()["A"]), finlab.load_allocator(checkpoint=untrained_checkpoint)
    )
    mixed = {**bundle.files, GRAPH: other.files[GRAPH]}
    with pytest.raises(DataError, match="are of different checkpoints"):
        parse_bundle(resealed(mixed))


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
        (lambda p: archive_of(p / "a.zip", **{NETWORK: bytes(70_000_000)}), "larger than 67,108,864 bytes"),
    ],
    ids=["missing", "empty", "path out of the archive", "large graph", "zip bomb"],
)
def test_what_is_no_bundle_is_refused(make: Callable[[Path], Path], message: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=message):
        read_bundle(make(tmp_path))


def test_a_link_in_a_folder_is_refused(bundle: Bundle, tmp_path: Path) -> None:
    bundle.write(tmp_path)
    (tmp_path / NETWORK).unlink()
    os.symlink("/dev/zero", tmp_path / NETWORK)
    with pytest.raises(DataError, match="network.onnx is no regular file"):
        read_bundle(tmp_path)


def test_a_folder_with_other_things_is_not_written_to(bundle: Bundle, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(DataError, match="holds 'thesis.tex', which is no part of a bundle"):
        bundle.write(tmp_path)


def test_methods_that_do_not_travel_are_refused() -> None:
    with pytest.raises(AllocationError, match="method 'sqp' cannot be exported"):
        make_bundle(finlab.load_layout(shipped_layouts()["A"]), finlab.load_allocator("sqp"))


def test_export_refuses_names_that_are_neither(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "A", "-o", "A.graph.json", "--zip"]) == 2
    assert "a graph file alone is not zipped" in capsys.readouterr().err
    assert checkpoint_path().is_dir()
