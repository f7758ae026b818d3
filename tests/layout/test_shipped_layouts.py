"""Every layout in `layouts/`: loads, keeps what its description promises, survives a round trip."""

import itertools

import numpy as np
import pytest

from finlab.assets import shipped_layouts
from finlab.layout import layout_to_dict, load_layout, own_effectiveness, parse_layout, save_layout

SHIPPED = shipped_layouts()
"""Name of a shipped robot -> its file."""
AXES = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
"""Names of the axes of a wrench."""


def columns(layout):
    """Wrenches (6, k) of 1 N along all directions in which the actuators push, rudders by their
    lift when the water comes from ahead."""
    pushes = {
        "fin": slice(1, 3),
        "azimuth": slice(1, 3),
        "thruster": slice(0, 1),
        "rudder": slice(2, 3),
    }
    own = zip(layout.actuators, own_effectiveness(layout), strict=True)
    return np.concatenate([axes[pushes[part.type]] for part, axes in own]).T


def rank(layout):
    """How many axes a robot drives independently."""
    return int(np.linalg.matrix_rank(columns(layout), tol=1e-6))


def missing_axes(layout):
    """Names of the axes that a robot cannot drive."""
    rows = columns(layout)
    return [axis for axis, row in zip(AXES, rows, strict=True) if np.abs(row).max() < 1e-9]


@pytest.mark.parametrize("name", SHIPPED)
def test_file_name_description_and_round_trip(name, tmp_path):
    layout = load_layout(SHIPPED[name])
    assert layout.name == name
    assert len(layout.description) > 60
    assert parse_layout(layout_to_dict(layout)) == layout
    for suffix in (".yaml", ".json"):
        save_layout(layout, tmp_path / f"copy{suffix}")
        assert load_layout(tmp_path / f"copy{suffix}") == layout


def test_there_is_something_to_teach():
    counts = {load_layout(path).n_fins for path in SHIPPED.values()}
    assert counts >= {2, 3, 4, 5, 6, 8}
    assert {"A", "B", "C", "D", "ucat"} <= set(SHIPPED)


@pytest.mark.parametrize(
    ("name", "expected", "missing"),
    [
        ("A", 6, []),
        ("B", 6, []),
        ("C", 6, []),
        ("D", 5, ["Fy"]),
        ("pair", 4, ["Fy", "Ty"]),
        ("penta", 6, []),
        ("hexa", 6, []),
        ("octo", 6, []),
        ("asymmetric", 6, []),
        ("mixed", 6, []),
        ("restricted", 6, []),
        ("no_yaw", 5, ["Tz"]),
        ("ucat", 6, []),
        ("turtle_hybrid", 6, []),
        ("bluerov2_heavy", 6, []),
        ("bluerov2", 5, []),
        ("torpedo", 4, []),
        ("catamaran", 3, ["Fz", "Tx", "Ty"]),
        ("supply", 5, ["Fz"]),
        ("drillship", 4, ["Fz", "Ty"]),
        ("fish", 5, []),
    ],
)
def test_rank_and_missing_axes(name, expected, missing):
    layout = load_layout(SHIPPED[name])
    assert rank(layout) == expected
    assert missing_axes(layout) == missing


def test_every_rank_above_is_of_a_shipped_layout_and_none_is_forgotten():
    tested = test_rank_and_missing_axes.pytestmark[0].args[1]
    assert {name for name, _, _ in tested} == set(SHIPPED)


def test_hexa_keeps_all_six_axes_after_any_two_losses():
    layout = load_layout(SHIPPED["hexa"])
    for lost in itertools.combinations(layout.names, 2):
        assert rank(layout.without(lost)) == 6, lost


def test_ucat_is_layout_a_with_a_body():
    ucat = load_layout(SHIPPED["ucat"])
    a = load_layout(SHIPPED["A"])
    assert ucat.fins == a.fins
    assert ucat.body.mass_kg == 19.0
    assert ucat.body.hull.shape == "ucat"
    assert all(
        len(getattr(ucat.body, key)) == 6
        for key in ("added_mass", "linear_damping", "quadratic_damping")
    )


def test_turtle_hybrid_is_ucat_with_two_thrusters():
    hybrid = load_layout("turtle_hybrid")
    ucat = load_layout("ucat")
    assert (hybrid.fins, hybrid.body) == (ucat.fins, ucat.body)
    assert [part.type for part in hybrid.actuators[4:]] == ["thruster", "thruster"]


def test_bluerov2_heavy_has_the_geometry_of_its_source():
    # Thrusts of least square, worked out from the source's table by hand.
    share = np.linalg.pinv(columns(load_layout("bluerov2_heavy"))) @ [
        30.0,
        15.0,
        -20.0,
        0.0,
        1.0,
        3.0,
    ]
    expected = [-20.4971, -0.7161, 9.8905, 11.3227, 7.6259, 8.0097, 1.9903, 2.3741]
    np.testing.assert_allclose(share, expected, atol=1e-4)


def test_restricted_zero_directions_confine_the_force_as_described():
    from finlab.physics import Plant

    layout = load_layout(SHIPPED["restricted"])
    rng = np.random.default_rng(0)
    lower = layout.lower
    upper = layout.upper
    force = Plant(layout).body_forces(rng.uniform(lower, upper, (500, 4, 3)))
    i = layout.index
    assert force[:, [i("front_left"), i("front_right")], 0].min() >= -1e-9
    assert force[:, i("back_left"), 2].min() > 0.0
    assert force[:, i("back_right"), 2].max() < 0.0


def test_loads_by_bare_name_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_layout(load_layout("pair"), "A.yaml")
    (tmp_path / "A").mkdir()
    assert load_layout("A") == load_layout(SHIPPED["A"])  # a folder here does not take its place
    assert load_layout("A.yaml") == load_layout("pair")
