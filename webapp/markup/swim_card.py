"""How a swim goes, in a few words and a row per robot."""

from collections.abc import Iterator
from html import escape

from webapp.markup.words import fins_words, three_digits, unlearned_sentence
from webapp.session.swim_plan import SwimSettings
from webapp.tasks.moment import Figures, Moment
from webapp.tasks.recorded import Recorded
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.swimming import Swimming
from webapp.theme import DELIVERED, KEPT, OTHER, Rgb, css

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
    return f"<span class='missing'>running at {rate:.1g}×, as fast as this machine can</span>"


def findings_words(shown: Moment) -> list[str]:
    """Which unannounced losses the monitor has detected, and which it has not."""
    sentences = [
        f"The monitor found {escape(name)} lost {seconds:.1f} s after it broke."
        for name, seconds in shown.found
    ]
    for name in shown.lost:
        if name not in shown.failed:
            known = name in shown.doubted
            rest = "the monitor takes it for torn or stuck" if known else "the allocator does not know yet"
            sentences.append(f"<span class='missing'>{escape(name)} is lost, and {rest}.</span>")
    sentences += [
        f"<span class='missing'>The monitor takes {escape(name)} for torn or stuck.</span>"
        for name in shown.doubted
        if name not in (*shown.failed, *shown.lost)
    ]
    sentences += [
        f"<span class='missing'>{escape(name)} works, but the allocator takes it for lost.</span>"
        for name in shown.failed
        if name not in shown.lost
    ]
    return sentences


def robots(swimming: Swimming) -> Iterator[tuple[Swimmer | Recorded, Moment, Rgb, str]]:
    """Everyone on the page: the robot, its moment, its colour and its name in words."""
    for swimmer, moment, color in zip(swimming.swimmers, swimming.seen, (DELIVERED, OTHER), strict=False):
        yield swimmer, moment, color, swimmer.method
    if swimming.kept is not None and swimming.swimmers:
        kept = swimming.kept
        yield kept, kept.moment(swimming.seen_time), KEPT, f"kept: {kept.method}"


def swim_card(swimming: Swimming, settings: SwimSettings) -> str:
    """Time, pace, and per robot: distance from where it should be, depth error, power, what a pack lasts."""
    if not swimming.active:
        return "<div class='fl dim'>Start lets this robot swim, with the fins that work.</div>"
    if not swimming.swimmers:
        return "<div class='fl dim'>making ready …</div>"
    first = swimming.swimmers[0]
    shown = swimming.seen[0]
    head = f"<b>{shown.time:.1f} s</b> of {first.duration_s:.0f} s, {pace_words(swimming)}"
    head += f"; least {swimming.objective}"
    rows, packs = [], []
    for robot, moment, color, name in robots(swimming):
        dot = f"<span class='swatch' style='background:{css(color)};min-width:10px'>&nbsp;</span>"
        title = f"<td title='{escape(robot.about)}'>{dot}{escape(name)}</td>"
        rows.append(f"<tr>{title}{_cells(_errors(moment.figures))}</tr>")
        packs.append(f"<tr>{title}{_cells(_pack(moment.figures, settings))}</tr>")
    header = (
        "<tr><th>method</th>"
        "<th title='root mean square distance from where it should be'>off the path</th>"
        "<th title='the same of the depth'>depth</th>"
        "<th title='mean of all fins, with motor losses'>mean</th>"
        "<th title='the same over the last second'>now</th></tr>"
    )
    other = "the fins alone" if not settings.electronics_w else f"fins and {settings.electronics_w:g} W"
    pack_header = (
        f"<tr><th>{settings.pack_wh:g} Wh, {other}</th>"
        "<th title='by all fins so far, with motor losses'>used</th>"
        "<th title='at the mean power so far'>lasts</th>"
        "<th title='at the mean speed over ground so far'>range</th></tr>"
    )
    return (
        f"<div class='fl swim'><div class='said'>{head}</div><table>{header}{''.join(rows)}</table>"
        f"<table>{pack_header}{''.join(packs)}</table>{_warnings(swimming, shown)}</div>"
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


def _cells(texts: tuple[str, ...]) -> str:
    return "".join(f"<td>{text}</td>" for text in texts)


def _warnings(swimming: Swimming, shown: Moment) -> str:
    """What should not be overlooked, and what the monitor has found."""
    first = swimming.swimmers[0]
    warning = "".join(
        f"<div class='missing'>{escape(s.method)}: {unlearned_sentence(s.layout, s.unknown_fins)}.</div>"
        for s in swimming.swimmers
        if s.unknown_fins
    )
    if not shown.controllable:
        lost = [first.fins.index(name) for name in shown.failed]
        fins = f"Without {fins_words(lost)}" if lost else "With these fins"
        warning += (
            f"<div class='missing'>{fins} surge, heave and yaw are not free of each other: "
            "expect it to drift off.</div>"
        )
    return warning + "".join(f"<div>{sentence}</div>" for sentence in findings_words(shown))
