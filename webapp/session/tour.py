"""A tour for a class: each stop sets a state and says what to see in it; the way back is kept."""

from dataclasses import dataclass, replace

from webapp.session.files import shipped
from webapp.session.returning import Returning
from webapp.session.state import State
from webapp.session.targets import PRESETS


@dataclass(frozen=True)
class Step:
    """One stop of the tour."""

    title: str
    text: str
    """What to look at and what to try."""
    layout: str
    """Shipped layout that is shown."""
    target: tuple[float, float, float, float, float, float]
    """Wrench that is asked for [N, N m]."""
    failed: tuple[str, ...] = ()
    """Fins that have failed."""
    mode: int = 0
    """Which mode is shown."""
    method: str = "dual"
    swims: bool = False
    drawer: str = "Candidates"
    """What lies uppermost in the drawer; its task is open."""

    def state(self, now: State) -> State:
        """The state of this stop, with the settings of the present one."""
        return replace(
            now,
            layout=shipped()[self.layout],
            failed=self.failed,
            weak=(),
            stuck=(),
            target=self.target,
            method=self.method,
            policy=State.policy,
            links=(),
        )


STEPS = (
    Step(
        "A wrench becomes flapping",
        "The blue arrow and ring above the hull are what is asked: forward, and a turn to the left. Each fin "
        "answers with amplitude, frequency and direction; its arrow is its mean force. Green is the sum.",
        "ucat",
        PRESETS["Turn"],
    ),
    Step(
        "One wrench has many answers",
        "Four fins have twelve numbers, the wrench only six. Here a network proposes ways, each is made "
        "exact, and this is the second best. In the drawer below each numbered dot is one. Click some: the "
        "fins change, the green sum stays.",
        "ucat",
        PRESETS["Turn"],
        mode=1,
        method="mdn",
    ),
    Step(
        "A fin fails",
        "Fin 2 hangs down. It is left out, and the other three answer at once. Fail another "
        "one in the list, and read below the bars what is left undone.",
        "ucat",
        PRESETS["Turn"],
        failed=("front_left",),
    ),
    Step(
        "What a layout cannot do",
        "This robot has no way to turn left or right, however its fins flap: the yaw that is asked stays "
        "missing. Select a fin, turn its shaft by the ring, and yaw becomes possible.",
        "no_yaw",
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.2),
        drawer="Reach",
    ),
    Step(
        "It swims",
        "Ten times a second the controller asks for a wrench and the fins answer. The blue ball is where "
        "the robot should be. Break a fin by its number, and watch the others take over.",
        "ucat",
        PRESETS["Turn"],
        swims=True,
        drawer="Swim over time",
    ),
    Step(
        "Not fins alone",
        "Two thrusters lift this robot beside its four fins. Fins take little power at light load, thrusters "
        "take what is heavy: ask for more heave, and see who carries it. Finish brings your work back.",
        "turtle_hybrid",
        (1.2, 0.0, 4.0, 0.0, 0.0, 0.25),
    ),
)
"""The stops in order."""


class Guiding(Returning):
    """The tour."""

    stop: int | None = None
    """Where the tour is, None while there is none."""

    def next_stop(self) -> None:
        """The tour's first stop, or the one after this; after the last one the tour is over."""
        stop = 0 if self.stop is None else self.stop + 1
        if stop == len(STEPS):
            self.end_tour()
        else:
            self._leave()
            self._go(stop)

    def previous_stop(self) -> None:
        """The tour's stop before this one."""
        if self.stop is not None:
            self._go(max(self.stop - 1, 0))

    def end_tour(self) -> None:
        """Back to the work."""
        if self.stop is not None:
            self.stop = None
            self._come_back()

    def _go(self, stop: int) -> None:
        step = STEPS[stop]
        self._commit(f"Tour: {step.title}", step.state(self.state))
        self.stop, self.mode, self.selected = stop, step.mode, None
        self.show_drawer(step.drawer)
        self.display = replace(self.display, drawn="none")
