"""What a fit to swims is worth, in sentences and as a table."""

from finlab.fit.robot.robot_fit import UNTOLD, RobotFit
from finlab.layout import Azimuth, Thruster
from finlab.layout.force_table_file import DOUBT

OTHER_LAW = "thrust that grows otherwise with amplitude and frequency"


def summary(fit: RobotFit) -> tuple[str, ...]:
    """Returns what the fit is worth, a line each; the first says why it should not be trusted, if so."""
    doubts = fit.doubts()
    head = (f"{DOUBT}: {'; '.join(doubts)}",) if doubts else ()
    seconds = 0.1 * len(fit.model.motion)
    lines = [
        f"fitted to {seconds:.0f} s of swimming, of whose motion simulated swims explain {fit.explained:.1%}",
        *(
            f"{name} pushes the other way than the layout says; in the layout that is written it is turned"
            for name in fit.opposed
        ),
        *([f"used, since it helps on parts not seen: {OTHER_LAW}"] if fit.other_law else []),
        *([f"tried, and no help: {OTHER_LAW}"] if fit.other_law is False else []),
        "a common scale of all forces, damping and inertia does not follow from motion; it rests on the mass "
        "and added mass that the layout gave",
    ]
    if any(isinstance(part, Thruster | Azimuth) for part in fit.model.layout.actuators):
        lines.append(
            "a force in the layout is what a thruster gives: divide it by the strength that was found for "
            "what the thruster is to be sent"
        )
    untold = fit.untold()
    if untold:
        lines.append(f"the data cannot tell {', '.join(untold)}: there the layout's own values stand")
    return (*head, *lines)


def table(fit: RobotFit) -> str:
    """Every unknown with its standard error, and how much of what was doubtful before is left."""
    unknowns, vector, error = fit.fitted.unknowns, fit.fitted.vector, fit.error
    width = max(len(label) for label in unknowns.labels)
    lines = [f"{'':{width}}  {'found':>10}  {'+-':>9}  doubt left"]
    rows = zip(unknowns.labels, unknowns.units, vector, error, unknowns.scale, strict=True)
    for label, unit, value, own, scale in rows:
        said = "  not determined by the data" if own > UNTOLD else ""
        lines.append(
            f"{label:{width}}  {value * scale:10.4f}  {own * scale:9.4f}  {min(own, 1.0):9.0%} {unit}{said}"
        )
    return "\n".join(lines)
