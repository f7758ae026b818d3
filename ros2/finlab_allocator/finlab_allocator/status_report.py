"""What is said of the node's state and of its robot's authority, in words and numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

from finlab.allocation.allocation import Allocation
from finlab.analysis.authority import Authority, authority
from finlab.axes import AXES, MOTIONS, UNITS
from finlab.layout import Layout
from finlab_allocator.commander import Commander

OK = 0
"""Level of a state that is as it should be, by diagnostic_msgs/DiagnosticStatus."""
WARN = 1
"""Level of one to look at."""
ERROR = 2
"""Level of one that is wrong."""
MOVES_UNEXPLAINED = (
    "unknown: the robot moves as no fault of an actuator explains; a tether may pull, or the body "
    "is not as the layout says"
)
"""What is said where the monitor cannot name a fault."""
SENSOR_OF_VALUE = {"depth [m]": "the pressure", "drives heard": "the drives"}
"""What says each value that the monitor has heard."""
MUCH_LEFT = 0.999
"""Share of an axis' wrench from which on it counts as whole."""


@dataclass(frozen=True)
class Report:
    """One state, as a DiagnosticStatus has it."""

    name: str
    """What it is about."""
    level: int
    """`OK`, `WARN` or `ERROR`."""
    message: str
    """A sentence."""
    values: tuple[tuple[str, str], ...]
    """Names and values."""


def status_report(commander: Commander, warnings: Sequence[str] = ()) -> Report:
    """Returns the state of the node.

    Args:
        commander: what commands the robot.
        warnings: sentences about what is around it, such as another node on its topics.
    """
    parameters = commander.parameters
    level, message = _state_words(commander)
    answer = commander.answer
    values = [
        ("state", commander.state),
        ("robot", commander.layout.name),
        ("method", commander.robot.allocator.method),
        ("policy", parameters.policy),
        ("lost", ", ".join(commander.lost)),
        ("free", ", ".join(parameters.free)),
        ("power_w", "" if parameters.power_w is None else f"{parameters.power_w:g}"),
    ]
    if answer is not None:
        values += _answer_values(answer)
    values += [
        ("refusals", str(commander.refusals)),
        ("last refusal", commander.last_refusal),
        ("answers", str(commander.times.count)),
    ]
    if commander.times.count:
        for percent in (50, 99):
            passed_ms, processor_ms = commander.times.quantiles_ms(percent / 100.0)
            values.append((f"answer time p{percent} [ms]", f"{passed_ms:.3f}"))
            values.append((f"processor time p{percent} [ms]", f"{processor_ms:.3f}"))
    if commander.watch is not None:
        phrases = commander.watch.phrases()
        values.append(("found", "; ".join(phrases)))
        values += commander.watch.values()
        if commander.watch.diagnosis is None:
            warnings = (*warnings, "the monitor has no sample of the IMU yet")
        for name, value in (heard := commander.watch.heard()):
            if not value:
                warnings = (*warnings, f"the monitor has no sample of {SENSOR_OF_VALUE[name]} yet")
        values += heard
        if commander.watch.findings:
            warnings = (*warnings, f"found: {'; '.join(phrases)}")
        if commander.watch.is_unknown:
            warnings = (*warnings, MOVES_UNEXPLAINED)
    if warnings:
        level = max(level, WARN)
        message = "; ".join([message, *warnings])
    return Report("finlab_allocator: allocation", level, message, tuple(values))


def _state_words(commander: Commander) -> tuple[int, str]:
    """Level and sentence of the state, with the newest refusal."""
    level = WARN
    answer = commander.answer
    if commander.state == "inactive":
        message = "neutral: the node is not active"
    elif commander.state == "waiting":
        level = OK
        message = "neutral: no wrench has come yet"
    elif commander.state == "silent":
        message = f"neutral: no good wrench for {commander.parameters.watchdog_s:g} s"
    elif commander.state == "failed":
        level = ERROR
        message = f"neutral: {commander.failure}"
    elif answer is None or answer.reachable:
        level = OK
        message = "the wrench is delivered"
    else:
        message = f"not reached: {'; '.join(answer.binding)}"
    if commander.is_refused:
        level = max(level, WARN)
        message = f"refused: {commander.last_refusal}; before that: {message}"
    return level, message


def _answer_values(answer: Allocation) -> list[tuple[str, str]]:
    """What an answer gives, and what is missing."""
    values = [("reachable", str(answer.reachable).lower())]
    for axis, unit, missing in zip(AXES, UNITS, answer.unallocated.tolist(), strict=True):
        values.append((f"unallocated {axis} [{unit}]", f"{missing:.6g}"))
    values.append(("err_norm", f"{answer.err_norm:.3g}"))
    values.append(("power [W]", f"{answer.power:.6g}"))
    if answer.bound is not None:
        values.append(("bound [W]", f"{answer.bound:.6g}"))
    values.append(("binding", "; ".join(answer.binding)))
    values.append(("notes", "; ".join(answer.notes)))
    return values


@dataclass(frozen=True)
class AuthorityLeft:
    """What a robot can still push along each axis, beside what it can when it is whole."""

    whole: Authority
    """Without loss."""
    left: Authority
    """Now."""

    @classmethod
    def of(cls, layout: Layout, commander: Commander) -> "AuthorityLeft":
        """Returns that of a robot.

        Args:
            layout: the whole robot.
            commander: says what is lost and damaged of it.
        """
        damage = commander.damage
        damaged = layout if damage is None else damage.applied_to(layout)
        lost = set(commander.lost) | (set() if damage is None else set(damage.lost))
        return cls(authority(layout), authority(damaged, sorted(lost)))

    @property
    def least(self) -> tuple[float, ...]:
        """Least wrench along each axis (6,) [N, N m], at most 0."""
        return tuple(-size + 0.0 for size in self.left.most_negative)

    @property
    def largest(self) -> tuple[float, ...]:
        """Largest wrench along each axis (6,) [N, N m]."""
        return self.left.largest

    def reports(self) -> list[Report]:
        """Returns a state for each axis: the least and the largest wrench along it, with the other
        five at zero, which no command can exceed, and the share of the whole robot's."""
        reports = []
        for k, (axis, motion, unit) in enumerate(zip(AXES, MOTIONS, UNITS, strict=True)):
            largest = self.largest[k]
            least = self.least[k]
            whole = min(self.whole.largest[k], self.whole.most_negative[k])
            now = min(largest, -least)
            share = 1.0 if whole <= 0.0 else min(now / whole, 1.0)
            level = OK if share >= MUCH_LEFT else WARN
            message = f"{least:.4g} to {largest:.4g} {unit}"
            if whole <= 0.0:
                message = "this robot does not push along it alone"
            elif now <= 0.0:
                level = ERROR
                message = "nothing is left both ways: " + message
            elif level == WARN:
                message = f"{100.0 * share:.0f} % is left: {message}"
            values = (
                (f"least [{unit}]", f"{least:.6g}"),
                (f"largest [{unit}]", f"{largest:.6g}"),
                ("share left", f"{share:.4f}"),
            )
            reports.append(Report(f"finlab_allocator: {axis} ({motion})", level, message, values))
        return reports
