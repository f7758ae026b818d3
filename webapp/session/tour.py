"""A tour for a class: each stop sets a state and says what to see in it; the way back is kept."""

from dataclasses import dataclass, replace

from webapp.session.core import Core
from webapp.session.files import shipped
from webapp.session.state import State
from webapp.session.targets import PRESETS


@dataclass(frozen=True)
class Step:
    """One stop of the tour."""

    title: str
    """What it is about."""
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
    method: str = "search"
    """Who answers."""
    graph: bool = False
    """Whether the fin graph is shown."""
    swims: bool = False
    """Whether the robot swims."""

    def state(self, now: State) -> State:
        """The state of this stop, with the objective and the settings of the present one."""
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
        "Four fins have twelve numbers, the wrench only six. This is another answer than before. Open Modes: "
        "each numbered dot is one, with the power that it takes. Click some: the fins change, the green sum "
        "stays.",
        "ucat",
        PRESETS["Turn"],
        mode=1,
    ),
    Step(
        "A fin fails",
        "Fin 2 hangs limp. The search leaves it out and answers at once with the other three. Fail another "
        "one under Wrench, and read below the bars what is left undone.",
        "ucat",
        PRESETS["Turn"],
        failed=("front_left",),
    ),
    Step(
        "What a layout cannot do",
        "This robot has no way to turn left or right, however its fins flap: the yaw that is asked stays "
        "missing. Open Layout, turn a shaft, and watch yaw come alive.",
        "no_yaw",
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.2),
    ),
    Step(
        "It swims",
        "Ten times a second the controller asks for a wrench and the search answers. The blue ball is where "
        "the robot should be. Open Swim, break a fin by its number, and watch the others take over.",
        "ucat",
        PRESETS["Turn"],
        swims=True,
    ),
    Step(
        "Another robot, and a network",
        "Six fins now, and the method is mdn: a network that reads the robot as a graph proposes, and the "
        "search makes each proposal exact. Modes shows both. Drag a fin, mirror it, save the file: the robot "
        "is yours.",
        "hexa",
        (1.5, 0.5, -1.0, 0.0, 0.0, 0.15),
        method="mdn",
        graph=True,
    ),
)
"""The stops in order."""


class Guiding(Core):
    """The tour."""

    stop: int | None = None
    """Where the tour is, None while there is none."""
    _before_tour: State | None = None

    def next_stop(self) -> None:
        """The tour's first stop, or the one after this; after the last one the tour is over."""
        if self.stop is None:
            self._before_tour = self.state
        stop = 0 if self.stop is None else self.stop + 1
        if stop == len(STEPS):
            self.end_tour()
        else:
            self._go(stop)

    def previous_stop(self) -> None:
        """The tour's stop before this one."""
        self._go(max((self.stop or 0) - 1, 0))

    def end_tour(self) -> None:
        """Back to what was there before the tour."""
        if self._before_tour is not None:
            self._commit("End the tour", self._before_tour)
            self.mode, self.sample = 0, None
        self.stop, self._before_tour = None, None

    def start_over(self) -> None:
        """Everything as at first sight, outside the tour."""
        self.stop, self._before_tour = None, None
        super().start_over()

    def _go(self, stop: int) -> None:
        step = STEPS[stop]
        self._commit(f"Tour: {step.title}", step.state(self.state))
        self.stop, self.mode, self.selected = stop, step.mode, None
        self.display = replace(self.display, graph=step.graph)
