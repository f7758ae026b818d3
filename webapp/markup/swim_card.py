"""How a swim goes, in a few words and a row per robot."""

from collections.abc import Iterator

from markupsafe import Markup

from webapp.markup.html import html, row
from webapp.markup.words import fins_words, three_digits, unlearned_sentence
from webapp.session.swim_plan import SwimSettings
from webapp.tasks.moment import Figures, Moment
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.swimming import Swimming
from webapp.theme import DELIVERED, OTHER, Rgb, css

SLOWEST = 0.01
"""Mean speed over ground [m/s] below which a robot keeps a place, and its range means nothing."""


def pace_words(swimming: Swimming) -> str:
    """At what pace it goes, in words: what is asked for, or what the machine can do."""
    if swimming.at is not None:
        return "looking back"
    if swimming.done:
        return "arrived"
    if not swimming.running:
        return "paused"
    rate, speed = swimming.pace.rate, swimming.pace.speed
    if rate is None or rate > 0.9 * speed:
        return f"running at {speed:.2g}×"
    return html("<span class='missing'>running at {:.1g}×, as fast as this machine can</span>", rate)


def findings_words(shown: Moment) -> list[str]:
    """Which unannounced losses the monitor has detected, and which it has not."""
    sentences = [
        f"The monitor found {name} lost {seconds:.1f} s after it broke." for name, seconds in shown.found
    ]
    for name in shown.lost:
        if name not in shown.failed:
            known = name in shown.doubted
            rest = "the monitor takes it for torn or stuck" if known else "the allocator does not know yet"
            sentences.append(html("<span class='missing'>{} is lost, and {}.</span>", name, rest))
    sentences += [
        html("<span class='missing'>The monitor takes {} for torn or stuck.</span>", name)
        for name in shown.doubted
        if name not in (*shown.failed, *shown.lost)
    ]
    sentences += [
        html("<span class='missing'>{} works, but the allocator takes it for lost.</span>", name)
        for name in shown.failed
        if name not in shown.lost
    ]
    return sentences


def robots(swimming: Swimming) -> Iterator[tuple[Swimmer, Moment, Rgb, str]]:
    """Everyone on the page: the robot, its moment, its colour and its name in words."""
    for swimmer, moment, color in zip(swimming.swimmers, swimming.seen, (DELIVERED, OTHER), strict=False):
        yield swimmer, moment, color, swimmer.method


def swim_card(swimming: Swimming, settings: SwimSettings) -> str:
    """Time, pace, and per robot: distance from where it should be, depth error, power, what a pack lasts."""
    if not swimming.active:
        return Markup("<div class='fl dim'>Start lets this robot swim, with the fins that work.</div>")
    if not swimming.swimmers:
        return Markup("<div class='fl dim'>making ready …</div>")
    first = swimming.swimmers[0]
    shown = swimming.seen[0]
    head = html("<b>{:.1f} s</b> of {:.0f} s, {}", shown.time, first.duration_s, pace_words(swimming))
    rows, packs = [], []
    for robot, moment, color, name in robots(swimming):
        dot = html("<span class='swatch' style='background:{};min-width:10px'>&nbsp;</span>", css(color))
        title = html("<span title='{}'>{}{}</span>", robot.about, dot, name)
        rows.append(row(title, *_errors(moment.figures)))
        packs.append(row(title, *_pack(moment.figures, settings)))
    header = Markup(
        "<tr><th>method</th>"
        "<th title='root mean square distance from where it should be'>off the path</th>"
        "<th title='the same of the depth'>depth</th>"
        "<th title='mean of all fins, with motor losses'>mean</th>"
        "<th title='the same over the last second'>now</th></tr>"
    )
    other = "the fins alone" if not settings.electronics_w else f"fins and {settings.electronics_w:g} W"
    pack_header = html(
        "<tr><th>{:g} Wh, {}</th><th title='by all fins so far, with motor losses'>used</th>"
        "<th title='at the mean power so far'>lasts</th><th title='at the mean speed over "
        "ground so far'>range</th></tr>",
        settings.pack_wh,
        other,
    )
    return html(
        "<div class='fl swim'><div class='said'>{}</div><table>{}{}</table><table>{}{}</table>{}</div>",
        head,
        header,
        rows,
        pack_header,
        packs,
        _warnings(swimming, shown),
    )


def _errors(figures: Figures | None) -> tuple[str, ...]:
    if figures is None:
        return ("–",) * 4
    return (
        f"{100 * figures.track_m:.1f} cm",
        f"{100 * figures.depth_m:.1f} cm",
        f"{figures.mean_w:.2f} W",
        f"{figures.now_w:.2f} W",
    )


def _pack(figures: Figures | None, settings: SwimSettings) -> tuple[str, ...]:
    """What has been used, how long a pack lasts, and how far the robot gets with it."""
    if figures is None or figures.mean_w + settings.electronics_w <= 0.0:
        return ("–",) * 3
    hours = settings.pack_wh / (figures.mean_w + settings.electronics_w)
    far = 3.6 * figures.speed_m_s * hours
    range_km = f"{three_digits(far)} km" if figures.speed_m_s >= SLOWEST else "–"
    return f"{figures.energy_wh * 1000:.1f} mWh", f"{three_digits(hours)} h", range_km


def _warnings(swimming: Swimming, shown: Moment) -> str:
    """What should not be overlooked, and what the monitor has found."""
    first = swimming.swimmers[0]
    warning = Markup().join(
        html("<div class='missing'>{}: {}.</div>", s.method, unlearned_sentence(s.layout, s.unknown_fins))
        for s in swimming.swimmers
        if s.unknown_fins
    )
    if not shown.controllable:
        lost = [first.fins.index(name) for name in shown.failed]
        fins = f"Without {fins_words(lost)}" if lost else "With these fins"
        warning += html(
            "<div class='missing'>{} surge, heave and yaw are not free of each other: expect it "
            "to drift off.</div>",
            fins,
        )
    return warning + Markup().join(html("<div>{}</div>", sentence) for sentence in findings_words(shown))
