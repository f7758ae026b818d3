"""Fins that work in part: what is left of them is used, and no more."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.actuators.fin.fin_model import SCALES_THRUST, FinModelSpec
from finlab.allocation import Allocator
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.errors import AllocationError, FinlabError, LayoutError
from finlab.layout import Damage, Layout, Limits, load_layout
from finlab.physics import Plant
from tests.allocator_cache import AllocatorCache
from tests.terminal import refused

TARGET = [1.0, 0.3, 1.0, 0.0, 0.05, 0.1]
"""A wrench within reach of five fins that are whole [N, N m]."""


@pytest.fixture(scope="module")
def penta() -> Layout:
    """Five fins."""
    return load_layout(shipped_layouts()["penta"])


def test_a_weak_fin_keeps_to_what_is_left(search: AllocatorCache, penta: Layout) -> None:
    health = Damage(weak={"bow": 0.4})
    result = search.allocate(penta, TARGET, damage=health)
    assert result.err_norm < 1e-5
    whole = penta.fins[penta.index("bow")].limits
    amplitude, frequency, _ = result.command[penta.index("bow")]
    assert amplitude <= 0.4 * whole.amplitude[1] and frequency <= 0.4 * whole.frequency[1]
    result_out_of_reach = search.allocate(penta, [20.0, 0, 0, 0, 0, 0], damage=health)
    assert np.linalg.norm(result_out_of_reach.forces[penta.index("bow")]) < 0.05 * np.linalg.norm(
        result_out_of_reach.forces
    )


@pytest.mark.parametrize("kind", SCALES_THRUST)
def test_a_torn_fin_gives_its_share_at_every_command(
    search: AllocatorCache, penta: Layout, kind: str
) -> None:
    fins = tuple(replace(fin, model=FinModelSpec(kind)) for fin in penta.fins)
    layout = replace(penta, actuators=fins)
    bow = penta.index("bow")
    result = search.allocate(layout, TARGET, damage=Damage(torn={"bow": 0.4}))
    assert result.err_norm < 1e-5
    forces = result.forces
    law = Plant(layout).body_forces(result.command)
    assert np.linalg.norm(law[bow]) > 0.01, "the fin is in use"
    np.testing.assert_allclose(forces[bow], 0.4 * law[bow], rtol=1e-9)
    np.testing.assert_allclose(np.delete(forces, bow, 0), np.delete(law, bow, 0), rtol=1e-9)


def test_the_thrust_of_a_table_cannot_be_scaled() -> None:
    with pytest.raises(LayoutError, match="cannot be scaled"):
        FinModelSpec("table", (("path", "fin.csv"),)).scaled(0.5)
    with pytest.raises(
        AllocationError, match="damage: torn bow: expected a number of at most 1, got 1.5"
    ):
        Damage(torn={"bow": 1.5})


def test_a_stuck_fin_points_where_it_stays(search: AllocatorCache, penta: Layout) -> None:
    for angle in (0.7, -2.0, 0.7 + 2 * math.pi):
        result = search.allocate(penta, TARGET, damage=Damage(stuck={"bow": angle}))
        assert result.err_norm < 1e-5
        assert math.cos(result.command[penta.index("bow"), 2] - angle) == pytest.approx(1.0)


@pytest.mark.parametrize("method", ["dual", "sqp"])
def test_the_force_of_a_running_fin_is_made_up_for(method: str, penta: Layout) -> None:
    running_command = (0.4, 1.2, 1.0)
    result = Allocator(penta, method).allocate(
        TARGET, damage=Damage(running={"bow": running_command})
    )
    np.testing.assert_allclose(result.command[penta.index("bow")], running_command)
    assert result.err_norm < (1e-5 if method == "dual" else 0.02)
    np.testing.assert_allclose(result.wrench, Plant(penta).wrench(result.command), atol=1e-12)


def test_damage_and_failures_go_together(search: AllocatorCache, penta: Layout) -> None:
    name = penta.names[1]
    result = search.allocate(penta, TARGET, lost=[name], damage=Damage(stuck={"bow": 0.2}))
    assert np.isnan(result.command[1]).all() and result.command[
        penta.index("bow"), 2
    ] == pytest.approx(0.2)
    batch = search.allocate_batch(
        penta, [TARGET] * 2, lost=[name], damage=Damage(stuck={"bow": 0.2})
    )
    assert batch.command[:, penta.index("bow"), 2] == pytest.approx(0.2)


def test_whole_fins_are_left_alone(penta: Layout) -> None:
    assert Damage().applied_to(penta) == penta
    changed = Damage(weak={"bow": 0.5}).applied_to(penta)
    same = [a == b for a, b in zip(changed.fins, penta.fins, strict=True)]
    assert same.count(False) == 1


def test_nonsense_is_refused(search: AllocatorCache, penta: Layout) -> None:
    for bad in (
        {"weak": {"bow": 0.0}},
        {"weak": {"bow": 1.5}},
        {"stuck": {"bow": math.nan}},
        {"stuck": {"bow": 0.1}, "running": {"bow": (0.1, 1.0, 0.0)}},
    ):
        with pytest.raises(AllocationError, match="bow"):
            Damage(**bad)  # type: ignore[arg-type]
    with pytest.raises(FinlabError, match="nobody"):
        search.allocate(penta, TARGET, damage=Damage(weak={"nobody": 0.5}))


def test_the_command_line_tells_what_is_left(capsys: pytest.CaptureFixture[str]) -> None:
    wrench = ["--wrench", "0.5", "0", "0.5", "0", "0", "0"]
    damage = [
        "--weak",
        "front_left=0.5",
        "--stuck",
        "back_left=30",
        "--running",
        "back_right=0.3,1,90",
    ]
    assert main(["allocate", "A", *wrench, *damage]) == 0
    printed = capsys.readouterr().out
    assert "30.0" in printed
    for wrong in (
        ["--weak", "front_left"],
        ["--stuck", "front_left=up"],
        ["--running", "back_left=1,2"],
    ):
        assert f"{wrong[0][2:]}: expected NAME=" in refused(["allocate", "A", *wrench, *wrong])


@pytest.mark.parametrize(
    "wrong",
    [{"weak": {"bow": "x"}}, {"stuck": {"bow": None}}, {"running": {"bow": ()}}, {"weak": 3}],
)
def test_damage_of_the_wrong_type_is_refused_in_a_sentence(wrong: dict[str, object]) -> None:
    with pytest.raises(AllocationError, match="damage: .*expected .*, got "):
        Damage(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arc", "angle", "held"),
    [
        ((0.5 * math.pi, 1.5 * math.pi), -0.9 * math.pi, 1.1 * math.pi),
        ((0.5 * math.pi, 1.5 * math.pi), 1.2 * math.pi, 1.2 * math.pi),
        ((-1.5 * math.pi, -0.5 * math.pi), 0.9 * math.pi, -1.1 * math.pi),
        ((0.0, 2 * math.pi), -0.1, 2 * math.pi - 0.1),
        ((-0.3, 0.3), 4 * math.pi + 0.2, 0.2),
        ((-0.3, 0.3), 1.0, 1.0),
    ],
)
def test_a_stuck_fin_is_held_at_the_turn_within_its_limits(
    penta: Layout, arc: tuple[float, float], angle: float, held: float
) -> None:
    limits = Limits((0.1, 0.5), (0.2, 2.0), arc)
    layout = Damage(stuck={"bow": angle}).applied_to(penta.replace_actuator("bow", limits=limits))
    left = layout.fins[layout.index("bow")].limits
    assert left.zero_direction == pytest.approx((held, held))
    assert (left.amplitude, left.frequency) == ((0.1, 0.5), (0.2, 2.0))


@pytest.mark.parametrize(
    ("share", "amplitude", "frequency"),
    [(0.6, (0.1, 0.3), (1.0, 1.2)), (0.1, (0.05, 0.05), (0.2, 0.2))],
)
def test_what_is_left_of_a_weak_fins_limits(
    penta: Layout, share: float, amplitude: tuple[float, float], frequency: tuple[float, float]
) -> None:
    """The upper limits shrink; a lower one only where it would lie above."""
    whole = penta.replace_actuator("bow", limits=Limits((0.1, 0.5), (1.0, 2.0), (0.0, 1.0)))
    layout = Damage(weak={"bow": share}).applied_to(whole)
    limits = layout.fins[layout.index("bow")].limits
    assert limits.amplitude == pytest.approx(amplitude) and limits.frequency == pytest.approx(
        frequency
    )
    assert limits.zero_direction == (0.0, 1.0)
    others = [i for i, name in enumerate(penta.names) if name != "bow"]
    assert [layout.fins[i] for i in others] == [whole.fins[i] for i in others]
