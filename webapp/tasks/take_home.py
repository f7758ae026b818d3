"""Formats in which a robot is taken home: C, parameters of autopilots and of ROS, descriptions for
simulators, a matrix; and why not, where a format cannot hold it.

The texts are those that the command line writes (`finlab.exchange.convert.text_in`,
`finlab.deploy.c_sources`).
"""

from collections.abc import Callable
from dataclasses import dataclass

from finlab.deploy.c_sources import c_sources
from finlab.deploy.ros_parameters import ros_parameters
from finlab.display import as_sentence
from finlab.errors import FinlabError, LayoutError
from finlab.exchange import Exchange
from finlab.exchange.convert import text_in
from finlab.files.guarded import packed
from finlab.layout import Layout
from webapp.markup.words import in_app
from webapp.session.files import file_stem, robot_file, shipped_name
from webapp.session.state import Flow, State


@dataclass(frozen=True)
class HomeQuestion:
    """What is taken home."""

    layout: Layout
    lost: tuple[str, ...]
    """Names of its lost actuators."""
    policy: str
    flow: Flow | None
    """Velocity (6,) relative to the water [m/s, rad/s]; None at rest."""

    @staticmethod
    def of_state(state: State) -> "HomeQuestion":
        """The robot of a state."""
        return HomeQuestion(state.layout, state.lost, state.policy, state.flow)

    @property
    def working(self) -> Layout:
        """The layout without its lost actuators. LayoutError: none is left."""
        if len(self.lost) == self.layout.n:
            raise LayoutError("nothing of this robot works; repair an actuator first")
        return self.layout.without(self.lost) if self.lost else self.layout


@dataclass(frozen=True)
class Written:
    """A file that is taken home."""

    content: bytes
    notes: tuple[str, ...] = ()
    """Sentences on what the format has no place for."""


@dataclass(frozen=True)
class Format:
    """A format that robots are taken home in."""

    key: str
    """What the page calls it by."""
    label: str
    """On its button."""
    group: str
    """Heading under which it stands."""
    purpose: str
    """What it is for, in a few words."""
    end: str
    """End of the file's name, after the robot's."""
    write: Callable[[HomeQuestion], Written]
    """Makes the file. FinlabError: the format cannot hold the robot."""
    check: Callable[[HomeQuestion], Written] | None = None
    """The same without its content, where that takes a while; None where it does not."""

    def file_name(self, layout: Layout) -> str:
        """The name of the file."""
        return file_stem(layout.name) + self.end


@dataclass(frozen=True)
class Offer:
    """A format, and whether a robot can be taken home in it."""

    format: Format
    file_name: str
    notes: tuple[str, ...] = ()
    """What the format has no place for."""
    reason: str = ""
    """Why it cannot; empty where it can."""


def offers_of(question: HomeQuestion) -> tuple[Offer, ...]:
    """Which formats can hold a robot: all are tried."""
    offers = []
    for form in FORMATS:
        name = form.file_name(question.layout)
        try:
            written = (form.check or form.write)(question)
        except FinlabError as error:
            offers.append(Offer(form, name, reason=in_app(as_sentence(str(error)))))
        else:
            offers.append(Offer(form, name, written.notes))
    return tuple(offers)


def _exchanged(form: str, suffix: str) -> Callable[[HomeQuestion], Written]:
    """Writes a robot, with what is lost of it, in a format of others."""

    def write(question: HomeQuestion) -> Written:
        exchange = Exchange()
        text = text_in(form, question.layout, exchange, suffix)
        notes = [in_app(f"{note.sentence}.") for note in exchange.taken]
        return Written(text.encode(), tuple(notes))

    return write


def _check_c(question: HomeQuestion) -> Written:
    """What there is to say of the C files, which take a tenth of a second."""
    layout = question.working
    if layout.interaction is not None:
        raise LayoutError("C files know nothing of jets; switch Jets off first")
    notes = ["It allocates by method dual, in C99 without heap."]
    if question.lost:
        notes.append(f"It is of the robot without {', '.join(question.lost)}.")
    if question.flow is None and layout.flow_driven:
        names = ", ".join(layout.flow_driven)
        notes.append(
            f"At rest {names} give nothing; set the speed through the water that it is to be of."
        )
    elif question.flow is not None:
        notes.append(f"It is of {question.flow[0]:g} m/s through the water.")
    return Written(b"", tuple(notes))


def _write_c(question: HomeQuestion) -> Written:
    """The C sources, with a self-test and examples, in one archive."""
    notes = _check_c(question).notes
    return Written(packed(c_sources(question.working, flow=question.flow)), notes)


def _write_ros(question: HomeQuestion) -> Written:
    """Parameters of the ROS 2 node."""
    robot = robot_file(question.layout)
    text = ros_parameters(robot, question.policy, question.lost)  # type: ignore[arg-type]
    notes: tuple[str, ...] = ()
    if robot != shipped_name(question.layout):
        notes = (f"It names {robot}: save that, too, at the right.",)
    return Written(text.encode(), notes)


BOARDS = "On board"
AUTOPILOTS = "Autopilots"
SIMULATORS = "Simulators"
FORMATS = (
    Format("c", "C99 (ZIP)", BOARDS, "for a microcontroller", "_c.zip", _write_c, _check_c),
    Format("ros", "ROS 2 (YAML)", BOARDS, "parameters of its node", "_ros2.yaml", _write_ros),
    Format(
        "px4",
        "PX4",
        AUTOPILOTS,
        "parameters for QGroundControl",
        ".params",
        _exchanged("px4", ".params"),
    ),
    Format(
        "ardusub",
        "ArduSub",
        AUTOPILOTS,
        "lines that add its motors",
        ".cpp",
        _exchanged("ardusub", ".cpp"),
    ),
    Format(
        "matrix",
        "Matrix (CSV)",
        AUTOPILOTS,
        "wrench of each thruster per newton",
        "_matrix.csv",
        _exchanged("matrix", ".csv"),
    ),
    Format("urdf", "URDF", SIMULATORS, "for ROS and Gazebo", ".urdf", _exchanged("urdf", ".urdf")),
    Format("sdf", "SDF", SIMULATORS, "for Gazebo", ".sdf", _exchanged("sdf", ".sdf")),
    Format("mjcf", "MJCF", SIMULATORS, "for MuJoCo", ".xml", _exchanged("mjcf", ".xml")),
)
"""All formats, by group."""
BY_KEY = {form.key: form for form in FORMATS}
