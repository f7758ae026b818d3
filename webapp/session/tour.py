"""A tour for a class: each stop sets a state and says what to see in it."""

from dataclasses import dataclass

from webapp.session.shipped import shipped
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
    graph: bool = False
    """Whether the fin graph is shown."""
    swims: bool = False
    """Whether the robot swims."""

    def state(self, now: State) -> State:
        """The state of this stop, with the settings of the present one."""
        return State(
            shipped()[self.layout],
            self.failed,
            target=self.target,
            n_candidates=now.n_candidates,
            temperature=now.temperature,
            gamma=now.gamma,
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
        "each numbered dot is one. Click some: the fins change, the green sum stays.",
        "ucat",
        PRESETS["Turn"],
        mode=1,
    ),
    Step(
        "A fin fails",
        "Fin 2 hangs limp and has left the graph. The same network answers at once with the other three. "
        "Fail another one under Wrench, and read below the bars what is left undone.",
        "ucat",
        PRESETS["Turn"],
        failed=("front_left",),
        graph=True,
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
        "Ten times a second the controller asks for a wrench and the network answers. The blue ball is where "
        "the robot should be. Open Swim, break a fin by its number, and watch the others take over.",
        "ucat",
        PRESETS["Turn"],
        swims=True,
    ),
    Step(
        "Another robot, the same network",
        "Six fins now, and nothing was trained again: the network reads the layout as a graph. Drag a fin by "
        "its arrows, mirror it, save the file. The robot is yours.",
        "hexa",
        (1.5, 0.5, -1.0, 0.0, 0.0, 0.15),
        graph=True,
    ),
)
"""The stops in order."""
