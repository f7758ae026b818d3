"""Outcomes in a few words and figures: how a swim goes, and what a fit is worth, the verdict
first."""

from markupsafe import Markup

from webapp.markup.words import fins_words, html, row, three_digits, unlearned_sentence
from webapp.tasks.fitting import FitResult
from webapp.tasks.swimmer import Moment, Swimmer
from webapp.tasks.swimming import Swimming


def pace_words(swimming: Swimming) -> str:
    """At what pace it goes, in words: what is asked for, or what the machine can do."""
    capsized = None if swimming.swimmer is None else swimming.swimmer.visible_moment.capsized
    if capsized is not None:
        return html("<span class='missing'>capsized at {:.1f} s</span>", capsized)
    if swimming.done:
        return "arrived"
    if not swimming.running:
        return "paused"
    rate = swimming.pace.rate
    speed = swimming.pace.speed
    if rate is None or rate > 0.9 * speed:
        return f"running at {speed:.2g}×"
    return html(
        "<span class='missing'>{:.1f}× of {:g}×, as fast as this machine can</span>", rate, speed
    )


def findings_words(moment: Moment) -> list[str]:
    """Which unannounced losses the monitor has detected, and which it has not."""
    sentences = [
        f"The monitor found {name} lost {seconds:.1f} s after it broke."
        for name, seconds in moment.found
    ]
    for name in moment.lost:
        if name not in moment.believed_lost:
            known = name in moment.doubted
            rest = (
                "the monitor takes it for torn or stuck"
                if known
                else "the allocator does not know yet"
            )
            sentences.append(html("<span class='missing'>{} is lost, and {}.</span>", name, rest))
    sentences += [
        html("<span class='missing'>The monitor takes {} for torn or stuck.</span>", name)
        for name in moment.doubted
        if name not in (*moment.believed_lost, *moment.lost)
    ]
    sentences += [
        html("<span class='missing'>{} works, but the allocator takes it for lost.</span>", name)
        for name in moment.believed_lost
        if name not in moment.lost
    ]
    return sentences


def swim_card(swims: bool, swimmer: Swimmer | None, moment: Moment | None) -> str:
    """Distance from where the robot should be, depth error, power and energy so far, and what was
    found."""
    if not swims:
        return Markup("<div class='fl dim'>Start lets this robot swim, with what works.</div>")
    if swimmer is None or moment is None:
        return Markup("<div class='fl dim'>making ready …</div>")
    figures = moment.figures
    rows = (
        []
        if figures is None
        else [
            row("off the path, root mean square", f"{figures.track_m:.3f} m"),
            row("off in depth", f"{figures.depth_m:.3f} m"),
            row("mean power", f"{figures.mean_w:.2f} W"),
            row("energy so far", f"{figures.energy_wh * 1000:.1f} mWh"),
        ]
    )
    return html("<div class='fl swim'><table>{}</table>{}</div>", rows, _warnings(swimmer, moment))


def _warnings(swimmer: Swimmer, moment: Moment) -> str:
    warning = Markup()
    if swimmer.unknown_fins:
        words = unlearned_sentence(swimmer.layout, swimmer.unknown_fins)
        warning += html("<div class='missing'>{}: {}.</div>", swimmer.method, words)
    if not moment.controllable:
        missing = [swimmer.fins.index(name) for name in moment.believed_lost]
        fins = "With these actuators"
        if missing:
            fins = f"Without {fins_words(missing, swimmer.layout)}"
        warning += html(
            "<div class='missing'>{} surge, heave and yaw are not free of each other: expect it "
            "to drift off.</div>",
            fins,
        )
    return warning + Markup().join(
        html("<div>{}</div>", sentence) for sentence in findings_words(moment)
    )


MOST_NAMED = 8


def fit_card(result: FitResult) -> str:
    """What came of a file that was dropped on an actuator."""
    from finlab.fit.thruster_fit import ThrusterFit, summary  # scipy comes with it

    name = result.upload.name
    fit = result.fit
    if fit is None:
        sentence = html(
            "<b>{} is a finished table.</b> It is on {} as it stands.",
            name,
            result.upload.actuator.name,
        )
        return html("<div class='fl said'>{}</div>", sentence)
    if isinstance(fit, ThrusterFit):
        return html(
            "<div class='fl'>{}</div>",
            [html("<div class='said'>{}</div>", _sentence(line)) for line in summary(fit)],
        )
    if fit.doubts:
        verdict = html("<b class='missing'>Not to be trusted: {}.</b>", "; ".join(fit.doubts))
    else:
        verdict = Markup("<b class='given'>May be trusted within what was measured.</b>")
    rows = (
        row("cross-validated error, of the largest force", f"{100.0 * fit.error():.1f} %"),
        row("noise of a sample, of the largest force", f"{100.0 * fit.noise():.1f} %"),
        row("unseen samples within the 95 % band", f"{100.0 * fit.coverage():.0f} %"),
        row(f"largest force of {len(fit.measurements)} samples", f"{three_digits(fit.largest)} N"),
    )
    parts = [html("<div class='said'>{}</div><table>{}</table>", verdict, rows)]
    left = "No sample was left out."
    count = len(fit.outliers)
    if count:
        named = ", ".join(fit.outliers[:MOST_NAMED]) + (" …" if count > MOST_NAMED else "")
        left = (
            f"{count} {'sample contradicts' if count == 1 else 'samples contradict'} the others: "
            f"{named}."
        )
    parts.append(html("<div class='said'>{}</div>", left))
    parts += [
        html("<div class='said dim'>{}</div>", _sentence(note)) for note in fit.measurements.notes
    ]
    return html("<div class='fl'>{}</div>", parts)


def _sentence(note: str) -> str:
    return f"{note[:1].upper() + note[1:]}."
