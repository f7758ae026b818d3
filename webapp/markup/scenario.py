"""What is true of a swim, and what the robot believes, in a line each."""

from collections.abc import Iterator

from finlab.sim import Changing, SensorSettings
from webapp.markup.html import html
from webapp.session.swim_plan import SwimSettings

FINS = {
    "mean": "",
    "ripple": "thrust comes in beats",
    "flexible": "fins have soft tips",
    "wake": "fins weaken each other by their jets",
    "inflow": "thrust falls with speed",
    "offset": "fins and weights are not where they are drawn",
}
"""What is true of the fins, by plant."""


def scenario_card(settings: SwimSettings) -> str:
    """What the scenario is about, what is true, what is believed."""
    day = settings.day
    true = "; ".join(_true(settings)) or "as drawn"
    believed = "the layout, in still water" if true != "as drawn" else "the same"
    losses = "Broken fins are announced." if settings.announced else "A monitor has to detect broken fins."
    return html(
        "<div class='fl scenario'><div>{}</div><div class='dim'>True: {}. Believed: {}. {}</div></div>",
        day.about,
        true,
        believed,
        losses,
    )


def _true(settings: SwimSettings) -> Iterator[str]:
    """What is not as drawn, piece by piece."""
    day = settings.day
    if settings.current_cm_s:
        turns = ", which turns on the way" if isinstance(settings.water, Changing) else ""
        yield f"current {settings.current_cm_s:g} cm/s towards {_minus(settings.heading_deg)}°{turns}"
    if settings.waves_cm:
        yield f"waves of {settings.waves_cm:g} cm"
    if settings.buoyancy_percent:
        word = "buoyant" if settings.buoyancy_percent > 0 else "heavy"
        yield f"{abs(settings.buoyancy_percent):g} % too {word}"
    if (factor := day.truth.get("damping", 1.0)) != 1.0:
        yield f"damping × {factor:g}"
    if "gravity_offset_m" in day.truth:
        yield f"centre of gravity {100 * day.truth['gravity_offset_m'][0]:g} cm ahead"
    if (late := day.sensors.marker.delay_s - SensorSettings().marker.delay_s) > 1e-9:
        yield f"sensors {1000 * late:.0f} ms later"
    if FINS[settings.plant]:
        yield FINS[settings.plant]
    if day.weak is not None:
        yield f"one fin at {100 * day.weak:g} %"
    if day.lost:
        yield f"{day.lost} fin{'s' if day.lost > 1 else ''} lost half-way"


def _minus(value: float) -> str:
    return f"{value:g}".replace("-", "−")
