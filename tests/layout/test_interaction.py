"""What fins take from each other, in layouts, layout files and graph files."""

from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest

from finlab.allocation import Allocator
from finlab.deploy.bundle import make_bundle
from finlab.errors import LayoutError
from finlab.layout import Interaction, Jet, Layout, layout_to_dict, load_layout, parse_layout, save_layout


@pytest.fixture(scope="module")
def coupled() -> Layout:
    layout = load_layout("A")
    jets = (Jet("front_right", "back_right", (0.2, 0.05)), Jet("back_left", "front_left", (0.1, -0.02)))
    return replace(layout, interaction=Interaction(jets, 0.3, 1.5, (0.3, 0.1)))


@pytest.mark.parametrize("suffix", ["yaml", "json"])
def test_files_keep_it(coupled: Layout, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"robot.{suffix}"
    save_layout(coupled, path)
    assert load_layout(path) == coupled


def test_it_fits_the_schema(coupled: Layout) -> None:
    import json

    schema = json.loads(Path("finlab/layout/layout.schema.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(layout_to_dict(coupled))


def test_bundles_take_it_along(coupled: Layout, tmp_path: Path) -> None:
    make_bundle(Allocator(coupled)).write(tmp_path / "bundle")
    again = load_layout(tmp_path / "bundle")
    assert again.interaction == coupled.interaction
    target = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
    here, there = (
        allocator.allocate(target)
        for allocator in (Allocator(coupled), Allocator.from_bundle(tmp_path / "bundle"))
    )
    assert here.err_norm < 1e-4 and there.err_norm < 1e-4
    assert there.power == pytest.approx(here.power, rel=1e-6)


def test_layouts_with_and_without_it_are_two(coupled: Layout) -> None:
    plain = replace(coupled, interaction=None)
    assert plain != coupled and hash(plain) != hash(coupled)
    assert coupled.has_inflow and not plain.has_inflow


def test_a_fin_may_be_renamed_and_lost(coupled: Layout) -> None:
    renamed = coupled.replace_actuator("front_right", name="bow")
    assert renamed.interaction is not None and renamed.interaction.jets[0].source == "bow"
    left = coupled.without(["back_right"])
    assert left.interaction is not None and [jet.source for jet in left.interaction.jets] == ["back_left"]


BAD = (
    (
        {"jets": [{"source": "x", "target": "front_left", "share": [0.1, 0.1]}]},
        r"jets\[0\].source: there is no fin",
    ),
    ({"jets": [{"source": "front_left", "target": "front_left", "share": [0.1, 0.1]}]}, "its own jet"),
    ({"jets": [{"source": "front_left", "target": "front_right", "share": [0.1]}]}, "2 values"),
    ({"jets": [{"source": "front_left", "target": "front_right", "share": [9, 0]}]}, r"share\[0\]"),
    ({"jets": [{"source": "front_left"}]}, "required key is missing"),
    ({"jets": 3}, "expected a list"),
    ({"half_thrust_n": 0}, "half_thrust_n"),
    ({"narrowness": -1}, "narrowness"),
    ({"inflow": [0.1]}, "inflow"),
    ({"wind": 1}, "unknown key"),
)


@pytest.mark.parametrize(("interaction", "why"), BAD)
def test_what_makes_no_sense_is_refused(interaction: object, why: str) -> None:
    data = {**layout_to_dict(load_layout("A")), "interaction": interaction}
    with pytest.raises(LayoutError, match=why):
        parse_layout(data)


def test_a_jet_is_named_once(coupled: Layout) -> None:
    assert coupled.interaction is not None
    with pytest.raises(LayoutError, match="given twice"):
        Interaction(coupled.interaction.jets[:1] * 2)
