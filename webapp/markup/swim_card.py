"""How a swim goes, in a few words and a row per robot."""

from html import escape

from webapp.markup.words import fins_words, unlearned_sentence
from webapp.tasks.swimmer import Moment
from webapp.tasks.swimming import Swimming
from webapp.theme import DELIVERED, OTHER, css


def pace_words(swimming: Swimming) -> str:
    """At what pace it goes, in words: what is asked for, or what the machine can do."""
    if swimming.done:
        return "arrived"
    if not swimming.running:
        return "paused"
    rate, speed = swimming.pace.rate, swimming.pace.speed
    if rate is None or rate > 0.9 * speed:
        return f"running at {speed:.2g}×"
    return f"<span class='missing'>running at {rate:.1g}×, as fast as this machine can</span>"


def findings_words(shown: Moment) -> list[str]:
    """What the monitor has found out of what nobody told, and what it has not."""
    sentences = [
        f"The monitor found {escape(name)} lost {seconds:.1f} s after it broke."
        for name, seconds in shown.found
    ]
    for name in shown.lost:
        if name not in shown.failed:
            sentences.append(
                f"<span class='missing'>{escape(name)} is lost, and the allocator does not know yet.</span>"
            )
    sentences += [
        f"<span class='missing'>{escape(name)} works, but the allocator takes it for lost.</span>"
        for name in shown.failed
        if name not in shown.lost
    ]
    return sentences


def swim_card(swimming: Swimming) -> str:
    """Time, pace, and per robot: distance from where it should be, depth error, power."""
    if not swimming.active:
        return "<div class='fl dim'>Start lets this robot swim, with the fins that work.</div>"
    if not swimming.swimmers:
        return "<div class='fl dim'>making ready …</div>"
    first = swimming.swimmers[0]
    head = f"<b>{first.shown.time:.1f} s</b> of {first.duration_s:.0f} s, {pace_words(swimming)}"
    head += f"; least {swimming.objective}"
    rows = []
    for swimmer, color in zip(swimming.swimmers, (DELIVERED, OTHER), strict=False):
        cells = "".join(
            f"<td>{'–' if value is None else f'{scale * value:.{digits}f}'}</td>"
            for value, scale, digits in (
                (swimmer.track_error, 100, 1),
                (swimmer.depth_error, 100, 1),
                (swimmer.power, 1, 2),
            )
        )
        dot = f"<span class='swatch' style='background:{css(color)};min-width:10px'>&nbsp;</span>"
        rows.append(f"<tr><td>{dot}{escape(swimmer.method)}</td>{cells}</tr>")
    warning = "".join(
        f"<div class='missing'>{escape(s.method)}: {unlearned_sentence(s.swim.layout, s.unknown_fins)}.</div>"
        for s in swimming.swimmers
        if s.unknown_fins
    )
    if not first.shown.controllable:
        lost = fins_words([first.fins.index(name) for name in first.shown.failed])
        warning += (
            f"<div class='missing'>Without {lost} surge, heave and yaw are not free of each other: "
            "expect it to drift off.</div>"
        )
    warning += "".join(f"<div>{sentence}</div>" for sentence in findings_words(first.shown))
    header = (
        "<tr><th>method</th>"
        "<th title='root mean square distance from where it should be'>off the path [cm]</th>"
        "<th title='the same of the depth'>depth [cm]</th>"
        "<th title='mean, with motor losses'>power [W]</th></tr>"
    )
    return (
        f"<div class='fl'><div class='said'>{head}</div><table>{header}{''.join(rows)}</table>{warning}</div>"
    )
