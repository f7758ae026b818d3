"""A supply vessel whose DP capability by DNV-ST-0111, level 1, somebody else has published, with
the numbers they found."""

from pathlib import Path

AZIMUTH = (
    "{{name: {name}, type: azimuth, position_m: [{x}, {y}, 0], turn_axis: [0, 0, 1], "
    "zero: [1, 0, 0], force_n: [0, 400000], model: {{type: power_law, forward: 0.01}}}}"
)
TUNNEL = (
    "{{name: {name}, type: thruster, position_m: [{x}, 0, 0], axis: [0, 1, 0], "
    "force_n: [-150000, 150000], model: {{type: power_law, forward: 0.01}}}}"
)
ACTUATORS = (
    AZIMUTH.format(name="AZ1", x=-40, y=5.5),
    AZIMUTH.format(name="AZ2", x=-40, y=-5.5),
    TUNNEL.format(name="BT1", x=31),
    TUNNEL.format(name="BT2", x=28),
)
RETRACTABLE = AZIMUTH.format(name="RAZ", x=22, y=0)
SHIP = """
ship:
  length_pp_m: 80
  breadth_m: 18
  draft_m: 6
  waterline: {length_m: 86, center_m: -1, aft_area_m2: 648, bow_angle_deg: 24.2277}
  wind: {frontal_area_m2: 280, lateral_area_m2: 700, lateral_center_m: 12}
  current: {lateral_area_m2: 490, lateral_center_m: -1.5}
  skegs_m: [[-36, 0]]
  groups: {SWBD 1: [AZ1, BT1], SWBD 2: [AZ2, BT2]}
  actuators:
    AZ1: {diameter_m: 3.0, power_kw: 2000, ducted: true, height_m: 1.8}
    AZ2: {diameter_m: 3.0, power_kw: 2000, ducted: true, height_m: 1.8}
    BT1: {diameter_m: 2.0, power_kw: 900, inlet: rounded, height_m: 2.5}
    BT2: {diameter_m: 2.0, power_kw: 900, inlet: broken, height_m: 2.5}
"""
SHIP_WITH_RETRACTABLE = SHIP + "    RAZ: {diameter_m: 1.8, power_kw: 800, height_m: -1.5}\n"


def layout_text(*actuators: str) -> str:
    """A layout file of actuators."""
    lines = [f"- {actuator}" for actuator in actuators]
    head = "format: finlab-layout\nversion: 2\nname: vessel\naxes: [Fx, Fy, Tz]\nactuators:\n"
    return head + "\n".join(lines) + "\n"


def write_vessel(folder: Path, retractable: bool) -> tuple[Path, Path]:
    """The files of the layout and of the ship."""
    layout = folder / "vessel.yaml"
    actuators = (*ACTUATORS, RETRACTABLE) if retractable else ACTUATORS
    layout.write_text(layout_text(*actuators))
    ship = folder / "ship.yaml"
    ship.write_text(SHIP_WITH_RETRACTABLE if retractable else SHIP)
    return layout, ship
