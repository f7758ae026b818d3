"""What the allocator does when a wrench is out of reach: closest, same direction, or in order of
priority."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from finlab.allocation import Allocation
from finlab.allocation.binding import limits_reached
from finlab.allocation.policy import CLOSEST, POLICY_NAMES, Policy, as_policy, policy_from
from finlab.assets import shipped_layouts
from finlab.axes import AXES
from finlab.core.fields import constant
from finlab.errors import AllocationError, CommandError
from finlab.layout import Fin, Layout, Limits, load_layout
from finlab.layout.effectiveness import layout_effectiveness
from finlab.physics import Plant
from tests.allocation.quick_allocator import OF_FINS
from tests.allocator_cache import AllocatorCache, normalized_error

FAR = (30.0, 5.0, 20.0, 1.0, 1.0, 1.0)
"""A wrench that robots of up to six such fins do not deliver."""
HEAVE_AND_ROLL = (0.0, 0.0, 20.0, 3.0, 0.0, 0.0)
"""A wrench out of reach of fins, in heave and roll alone [N, N m]."""
SHALLOW = (30.0, 0.0, 6.0, 0.0, 0.0, 0.0)
"""Its heave alone can be delivered, the whole cannot."""
PATIENT = ("ipopt", "sqp")
"""Methods of the table that are left to their own tests here."""


def test_a_name_stands_for_one_policy_with_the_usual_weights_and_order() -> None:
    for name in POLICY_NAMES:
        assert as_policy(name) == Policy(name)
        assert as_policy(name) is as_policy(name)
    assert as_policy("closest") is CLOSEST


def test_the_core_knows_every_policy_and_no_other() -> None:
    numbers = [constant(f"FL_{name.upper()}") for name in POLICY_NAMES]
    assert sorted(numbers) == list(range(constant("FL_POLICIES")))


def shipped(name: str) -> Layout:
    """A shipped robot by its name."""
    return load_layout(shipped_layouts()[name])


def least_error(
    layout: Layout, target: np.ndarray, weights: np.ndarray, n_starts: int = 3
) -> float:
    """Weighted error that scipy finds on the plant from several starts."""
    lower = layout.lower
    upper = layout.upper
    plant = Plant(layout)
    rng = np.random.default_rng(0)

    def residual(command: np.ndarray) -> np.ndarray:
        return (plant.wrench(command.reshape(-1, 3)) - target) * weights

    starts = lower + rng.uniform(0.05, 0.95, (n_starts, *lower.shape)) * (upper - lower)
    costs = [
        least_squares(
            residual, start.ravel(), bounds=(lower.ravel(), upper.ravel()), max_nfev=50
        ).cost
        for start in starts
    ]
    return float(np.sqrt(2.0 * min(costs)))


def proven_error(layout: Layout, result: Allocation, target: np.ndarray) -> float:
    """An error that no command of fins that turn fully can undercut.

    The wrenches of all fins together lie within a convex set; the plane through its border that
    faces along the answer's residual is at least this far from the target.
    """
    residual = (target - result.wrench) / result.scale
    facing = residual / np.linalg.norm(residual)
    strongest = np.array(
        [[fin.limits.amplitude[1], fin.limits.frequency[1], 0.0] for fin in layout.fins]
    )
    thrust = np.linalg.norm(Plant(layout).body_forces(strongest), axis=1)
    pulls = ((facing / result.scale) @ layout_effectiveness(layout)).reshape(-1, 2)
    return float(facing @ (target / result.scale) - thrust @ np.linalg.norm(pulls, axis=1))


def cosine(result: Allocation) -> float:
    """Between what was asked and what is given, both normalized."""
    asked = result.target / result.scale
    wrench = result.wrench / result.scale
    return float(asked @ wrench / (np.linalg.norm(asked) * np.linalg.norm(wrench)))


@pytest.mark.parametrize(
    ("name", "target"),
    [("A", FAR), ("pair", FAR), ("restricted", HEAVE_AND_ROLL), ("restricted", FAR)],
)
def test_closest_is_no_worse_than_least_squares_on_the_plant(
    name: str, target: tuple[float, ...], search: AllocatorCache
) -> None:
    layout = shipped(name)
    result = search.allocate(layout, target)
    assert not result.reachable
    assert result.err_norm < 1.001 * least_error(layout, np.array(target), 1.0 / result.scale)


@pytest.mark.parametrize("name", ["A", "B", "penta", "pair", "hexa"])
@pytest.mark.parametrize("target", [FAR, (0.0, 60.0, 0.0, 0.0, 0.0, -6.0)])
def test_closest_is_proven_closest(
    name: str, target: tuple[float, ...], search: AllocatorCache
) -> None:
    layout = shipped(name)
    result = search.allocate(layout, target)
    assert not result.reachable
    assert result.err_norm < 1.0001 * proven_error(layout, result, np.array(target))


@pytest.mark.parametrize("axis", range(6))
def test_weights_move_the_error_away_from_an_axis(axis: int, search: AllocatorCache) -> None:
    layout = shipped("penta")
    plain = search.allocate(layout, FAR)
    weights = np.where(np.arange(6) == axis, 10.0, 1.0)
    result = search.allocate(layout, FAR, policy=Policy(axis_weights=tuple(weights)))
    assert abs(result.unallocated[axis]) < 0.9 * abs(plain.unallocated[axis])
    # Weighted, the answer is the better one; plainly, the other is.
    assert np.linalg.norm(weights * result.unallocated / result.scale) < np.linalg.norm(
        weights * plain.unallocated / plain.scale
    )
    assert plain.err_norm <= result.err_norm * (1.0 + 1e-6)


def test_weights_are_answered_as_well_as_by_least_squares(search: AllocatorCache) -> None:
    layout = shipped("restricted")
    weights = np.array([1.0, 1.0, 10.0, 1.0, 1.0, 1.0])
    result = search.allocate(layout, FAR, policy=Policy(axis_weights=tuple(weights)))
    error = np.linalg.norm(weights * result.unallocated / result.scale)
    assert error < 1.001 * least_error(layout, np.array(FAR), weights / result.scale, 2)


def test_equal_weights_change_nothing(search: AllocatorCache) -> None:
    layout = shipped("A")
    plain = search.allocate(layout, FAR)
    weighted = search.allocate(layout, FAR, policy=Policy(axis_weights=(3.0,) * 6))
    np.testing.assert_array_equal(weighted.command, plain.command)


@pytest.mark.parametrize(
    ("name", "target"), [("A", HEAVE_AND_ROLL), ("pair", SHALLOW), ("penta", FAR)]
)
def test_direction_is_kept_at_the_largest_scale(
    name: str, target: tuple[float, ...], search: AllocatorCache
) -> None:
    layout = replace(shipped(name), axes=AXES)
    result = search.allocate(layout, target, policy="direction")
    assert cosine(result) > 1.0 - 1e-9
    assert 0.0 < result.share < 1.0 and not result.reachable
    delivered = normalized_error(search.normalization, result.wrench, result.share * result.target)
    assert delivered < 1e-4
    for more in (1.001, 1.01, 1.03):
        beyond = more * result.share * result.target
        tried = search.allocate(layout, beyond)
        assert tried.err_norm > 1e-4 and (more < 1.005 or not tried.reachable)
        assert more < 1.005 or proven_error(layout, tried, beyond) > 0.0


def test_direction_within_arcs(search: AllocatorCache) -> None:
    layout = shipped("restricted")
    result = search.allocate(layout, FAR, policy="direction")
    assert cosine(result) > 1.0 - 1e-9
    more = 1.03 * result.share * result.target
    assert least_error(layout, more, 1.0 / result.scale, 2) > 0.01


@pytest.mark.parametrize("policy", POLICY_NAMES)
def test_what_is_reachable_is_delivered_whole_by_all(policy: str, search: AllocatorCache) -> None:
    layout = shipped("A")
    target = [1.0, 0.5, 2.0, 0.0, 0.1, 0.1]
    result = search.allocate(layout, target, policy=policy)
    assert result.reachable
    assert result.share == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_array_equal(result.command, search.allocate(layout, target).command)


@pytest.mark.parametrize("name", ["A", "penta", "restricted"])
def test_priority_serves_the_first_group_whole(name: str, search: AllocatorCache) -> None:
    layout = shipped(name)
    assert search.allocate(layout, [0.0, 0.0, SHALLOW[2], 0.0, 0.0, 0.0]).reachable
    plain = search.allocate(layout, SHALLOW)
    result = search.allocate(layout, SHALLOW, policy="priority")
    assert abs(result.unallocated[2]) < 1e-4 * SHALLOW[2] < abs(plain.unallocated[2])
    assert not result.reachable


def test_priority_serves_groups_in_the_order_asked(search: AllocatorCache) -> None:
    layout = shipped("pair")
    heave = search.allocate(layout, FAR, policy=Policy("priority", order=(("Fz",), ("Fx",))))
    surge = search.allocate(layout, FAR, policy=Policy("priority", order=(("Fx",), ("Fz",))))
    assert abs(heave.unallocated[2]) < abs(surge.unallocated[2])
    assert abs(surge.unallocated[0]) < abs(heave.unallocated[0])


def test_scale_of_nothing_is_one(search: AllocatorCache) -> None:
    assert search.allocate(shipped("A"), np.zeros(6)).share == 1.0


def test_binding_limits_are_named(search: AllocatorCache) -> None:
    strong = search.allocate(shipped("A"), (60.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert set(strong.binding) == {f"{name} at full thrust" for name in strong.names}
    stopped = search.allocate(shipped("restricted"), (-40.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert {f"{name} at the end of its arc" for name in stopped.names} <= set(stopped.binding)


def test_nothing_binds_where_the_target_is_delivered(search: AllocatorCache) -> None:
    for lost in ([], ["back_left"]):
        assert search.allocate(shipped("A"), np.zeros(6), lost=lost).binding == ()


def test_methods_without_weights_say_so() -> None:
    layout = shipped("pair")
    for name in OF_FINS:
        if name in ("dual", "mdn", "paper") or name in PATIENT:
            continue
        method = AllocatorCache(name)
        for policy in (
            Policy("priority"),
            Policy("direction"),
            Policy(axis_weights=(2.0, 1.0, 1.0, 1.0, 1.0, 1.0)),
        ):
            with pytest.raises(
                AllocationError, match=f"method '{name}' minimizes the plain error"
            ) as caught:
                method.allocate(layout, FAR, policy=policy)
            assert "use method 'dual'" in str(caught.value) and "\n" not in str(caught.value)
        assert np.isfinite(method.allocate(layout, FAR, policy=CLOSEST).command).all()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            {"kind": "nearest"},
            "policy: expected one of closest, direction, priority, falling, got 'nearest'",
        ),
        ({"axis_weights": (1.0,) * 5}, "axis_weights: expected six numbers from 0"),
        ({"axis_weights": (0.0,) * 6}, "axis_weights: expected six numbers from 0, not all 0"),
        (
            {"axis_weights": (1.0, -1.0, 1.0, 1.0, 1.0, 1.0)},
            "axis_weights: expected six numbers from 0",
        ),
        ({"axis_weights": (np.nan,) * 6}, "axis_weights: expected six numbers from 0"),
        ({"order": (("Fq",),)}, "order: expected axes among Fx, Fy, Fz, Tx, Ty, Tz, got 'Fq'"),
        ({"order": (("Fx",), ("Fz", "Fx"))}, "order: every axis may be named once"),
        ({"axis_weights": "abc"}, "axis_weights: "),
        ({"axis_weights": None}, "axis_weights: "),
        ({"order": 5}, "order: expected groups of axes"),
        ({"order": ("Fz",)}, "order: expected groups of axes"),
    ],
)
def test_bad_policies_are_refused(options: dict[str, object], sentence: str) -> None:
    with pytest.raises(CommandError) as caught:
        Policy(**options)  # type: ignore[arg-type]
    assert str(caught.value).startswith(sentence) and "\n" not in str(caught.value)


def test_a_name_that_is_no_policy_is_refused(search: AllocatorCache) -> None:
    with pytest.raises(CommandError, match="policy: expected one of"):
        search.allocate(shipped("A"), FAR, policy="nearest")


def test_policies_from_words() -> None:
    assert as_policy("closest") == policy_from("closest") == CLOSEST
    assert as_policy(CLOSEST) is CLOSEST
    assert policy_from("closest", ["1", 2, 1, 1, 1, 0]).axis_weights == (
        1.0,
        2.0,
        1.0,
        1.0,
        1.0,
        0.0,
    )
    assert policy_from("priority", None, ["Fx,Fy", "Tz"]).order == (("Fx", "Fy"), ("Tz",))


def test_groups_end_with_the_axes_that_are_not_named() -> None:
    groups = Policy("priority", order=(("Fz",), ("Tx", "Ty"))).groups
    assert [tuple(np.array(AXES)[group]) for group in groups] == [
        ("Fz",),
        ("Tx", "Ty"),
        ("Fx", "Fy", "Tz"),
    ]


@pytest.mark.parametrize(
    ("command", "sentences"),
    [
        ((0.4997, 1.999, 1.0), ["fin at full thrust"]),  # within a thousandth of each range
        ((0.4997, 1.997, 1.0), []),
        ((0.4995, 1.999, 1.0), []),
        ((0.3, 1.0, 0.501), ["fin at the end of its arc"]),
        ((0.3, 1.0, 0.502), []),
        ((0.3, 1.0, 1.4995), ["fin at the end of its arc"]),
        ((0.1, 0.5, 0.5), []),
        ((0.1, 0.6, 0.5), ["fin at the end of its arc"]),
        ((0.5, 2.0, 0.5), ["fin at full thrust", "fin at the end of its arc"]),
        ((np.nan, np.nan, np.nan), []),
    ],
)
def test_what_binds_by_hand(command: tuple[float, ...], sentences: list[str]) -> None:
    fin = Fin("fin", (0.1, 0.0, 0.0), 0.0, Limits((0.1, 0.5), (0.5, 2.0), (0.5, 1.5)))
    assert list(limits_reached(Layout("one", (fin,)), np.array([command]))) == sentences


def test_other_actuators_are_at_their_limits_as_well() -> None:
    boat = shipped("catamaran")
    words = limits_reached(boat, boat.upper)
    assert {f"{part.name} at full thrust" for part in boat.actuators} <= set(words)
    torpedo = shipped("torpedo")
    rudders = [part.name for part in torpedo.actuators if part.type == "rudder"]
    assert {f"{name} at the end of its arc" for name in rudders} <= set(
        limits_reached(torpedo, torpedo.lower)
    )
    rest = np.clip(0.0, torpedo.lower, torpedo.upper)
    assert limits_reached(torpedo, rest) == ()
