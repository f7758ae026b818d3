"""The names that users import, and the types of what they are asked for: none changes unnoticed."""

import importlib
import inspect
import pkgutil
from typing import Literal, get_args, get_origin, get_type_hints

import pytest

import finlab
from finlab.allocation import METHODS, Allocator, MethodName, Policy, PolicyName
from finlab.allocation.allocator import Allocator as Asked
from finlab.allocation.dual.method import DualSettings
from finlab.axes import AXES, Axis

NAMES = {
    "finlab": "Allocation Allocator Azimuth Body Damage Fin FinlabError Layout Limits Policy "
    "PowerLaw PowerTable PropellerRudder Rudder Thruster Tilt load_layout save_layout",
    "finlab.allocation": "Allocation Allocator BatchAllocation Candidates METHODS MethodName "
    "Policy PolicyName Solution",
    "finlab.analysis": "AXES AttainableSet Authority Bounds Capability GOALS Improvement KeepOut "
    "LayoutBound Loss Progress ScoreCard SecondLoss Ship attainable_set authority capability "
    "dp_capability layout_bound least_power losses mirror_pairs optimize_layout read_ship score_card second_losses",
    "finlab.swim.control": "CONTROLLERS Completion Controller Diagnosis DriveTelemetry FaultMonitor "
    "Finding Foresighted Learner Measurement MonitorSettings MotionObserver Setpoint TrackingController "
    "VelocityController WaypointController gains_for make_controller steerable_loss steers",
    "finlab.exchange": "Answers Choice Exchange FOREIGN Note Question QuestionError Reading "
    "convert is_robot_table mujoco_control read_any read_asking read_robot",
    "finlab.fit": "FinFit Measurements fit_fin read_measurements write_fin",
    "finlab.swim.hull": "Surface contradicts displaced estimated hull_of lift_of",
    "finlab.layout": "Actuator Azimuth Body Damage Fin FinModelSpec Hull Layout Limits "
    "MAX_ACTUATORS PropellerRudder Rudder Servo Thruster Tilt Uncertainty kept_clear layout_effectiveness layout_to_dict "
    "load_layout own_effectiveness parse_layout save_layout",
    "finlab.log": "Judgement Log judge read_log",
    "finlab.physics": "FinLaw Plant TableLaw make_law plant_of read_table write_table",
    "finlab.swim.simulation": "ClosedLoop Fault NOISE_ALONE NO_NOISE RunLog SHIPPED "
    "SensorSettings Tick Trajectory load_log make_trajectory perturbed straight",
    "finlab.swim.vehicle": "GRAVITY STATE_SIZE Vehicle complete_body ucat_body",
}
"""Package -> its public names. A change here is one for CHANGELOG.md."""


@pytest.mark.parametrize("package", NAMES)
def test_the_public_names_are_these(package: str) -> None:
    module = importlib.import_module(package)
    assert sorted(module.__all__) == sorted(NAMES[package].split())
    for name in module.__all__:
        assert getattr(module, name) is not None


def test_other_packages_promise_no_names() -> None:
    """A new public package gets its line above."""
    rooms = [f"finlab.{room.name}" for room in pkgutil.iter_modules(finlab.__path__) if room.ispkg]
    quiet = [room for room in rooms if room not in NAMES and room != "finlab.research.training"]
    assert [room for room in quiet if hasattr(importlib.import_module(room), "__all__")] == []


def test_every_name_of_the_front_door_is_listed_and_found() -> None:
    assert set(finlab.__all__) <= set(dir(finlab))
    with pytest.raises(
        AttributeError, match="has no attribute 'load_allocator'; it has Allocation, Allocator"
    ):
        _ = finlab.load_allocator


def test_names_in_arguments_have_types_that_list_them() -> None:
    """Editors complete them, and type checkers refuse others."""
    assert get_args(MethodName) == tuple(METHODS)
    assert get_args(PolicyName) == ("closest", "direction", "priority", "falling")
    assert get_args(Axis) == AXES
    assert get_type_hints(Policy)["kind"] == PolicyName
    assert get_type_hints(Policy)["order"] == tuple[tuple[Axis, ...], ...]
    assert MethodName in get_args(get_type_hints(Allocator.__init__)["method"])
    for call in (Asked.allocate, Asked.allocate_batch):
        hints = get_type_hints(call)
        assert get_args(hints["free"]) == (Axis,)
        literals = [part for part in get_args(hints["policy"]) if get_origin(part) is Literal]
        assert literals == [PolicyName]


def test_the_settings_of_dual_are_arguments_with_types_and_words() -> None:
    parameters = inspect.signature(Allocator.__init__).parameters
    hints = get_type_hints(Allocator.__init__)
    words = inspect.getdoc(Allocator.__init__) or ""
    for name in DualSettings.__dataclass_fields__:
        assert parameters[name].kind is inspect.Parameter.KEYWORD_ONLY
        assert hints[name] == float | None
        assert f"\n    {name}: " in words
    layout = finlab.load_layout("A")
    usual = DualSettings()
    assert Allocator(layout).settings == usual
    assert Allocator(layout, calm=1.0, robust=2.0, period_s=0.05).settings == DualSettings(
        calm=1.0, robust=2.0, period_s=0.05
    )
