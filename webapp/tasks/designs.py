"""Files of one page: designs opened, saved and shared, exports, and what a dropped file is for."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import PurePath

import viser

from finlab.allocation.allocation import Allocation
from finlab.analysis.capability import Capability
from finlab.deploy.bundle import make_bundle
from finlab.deploy.robot_graph import graph_text
from finlab.errors import FinlabError
from finlab.exchange import is_robot_table
from finlab.exchange.convert import TABLES
from finlab.files.worker import in_worker
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE
from finlab.swim.design_files import Opened, Unanswered
from finlab.swim.hull import hull_of
from webapp.handles import Presses
from webapp.session import Session, files
from webapp.session.files import BESIDE, FRAGMENT, WRENCH, file_stem, packed, unpacked
from webapp.session.granted import SourceFile
from webapp.session.looking import TWO_ROBOTS
from webapp.session.state import State, one_of
from webapp.tasks.importing import rows_of
from webapp.tasks.modes_csv import modes_csv
from webapp.tasks.slot import Deferred
from webapp.tasks.solver import Modes, Solver
from webapp.tasks.swimming import Swimming
from webapp.tasks.take_home import BY_KEY, HomeQuestion, Written
from webapp.viser_internals import run_script

KINDS = (
    "a design (YAML, JSON, ZIP), a robot of others (URDF, SDF, MuJoCo, Stonefish, PX4, ArduSub, a "
    "matrix), measurements of a fin (CSV), a hull (STL, OBJ, GLB, PLY), or a log (ULG, BIN, MCAP, "
    "DB3, BAG)"
)
"""The kinds of files that the page opens, for hints and errors."""
SHARED = (
    "The link carries the whole design and the wrench that is asked for, without faults. Whoever "
    "opens it gets a copy, on a finlab of their own."
)
"""What is said beside a link."""

SHARED_PAIR = (
    "The link carries both designs and the wrench that is asked for. Whoever opens it sees copies "
    "of both beside each other, on a finlab of their own."
)
"""What is said beside the link of two robots."""

Take = Callable[[str, bytes], object]
"""Takes a file that was opened: its name and its content."""


class Designs:
    """What one page does with its design; files are made beside the event loop."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        solver: Solver,
        deferred: Deferred,
        notify: Callable[..., None],
    ) -> None:
        """`notify` shows a note: title and sentence, and whether it is `calm`."""
        self._client = client
        self._session = session
        self._solver = solver
        self._deferred = deferred
        self._notify = notify

    def new(self, kind: str) -> None:
        """A robot with one hull and one actuator of a type."""
        self._session.new_layout(kind)
        self._session.show_task("Design")
        self.remind("New design")

    def remind(self, title: str) -> None:
        """Say that tour or lesson is open, if one is, and what becomes of this robot then."""
        reminder = self._session.guide.reminder
        if reminder:
            self._notify(title, reminder, calm=True)

    def open_shipped(self, layout: Layout) -> None:
        """A robot that is shipped."""
        before = self._session.state
        self._session.open_layout(layout)
        text = self._what_else(before)
        if text:
            self._notify(f"Opened {layout.name}", text, calm=True)

    def _what_else(self, before: State) -> str:
        """What another robot changed of how it is asked, and what becomes of it in a lesson."""
        return _with(changed_words(before, self._session.state), self._session.guide.reminder)

    def open_link(self, text: str) -> None:
        """A design from the part of an address behind the #; it may be anything."""
        design, wrench, other = files.parts_of_link(text)
        if not other:
            self._open_one_of_link(design, wrench)
            return

        def both() -> tuple[Opened, Opened]:
            pair = in_worker(unpacked, design), in_worker(unpacked, other)
            for opened in pair:
                hull_of(opened.layout)  # what is drawn of it takes its time
            return pair

        self._deferred.make(both, partial(self._take_pair, wrench), "open")

    def _open_one_of_link(self, design: str, wrench: str) -> None:
        """The robot of a link that carries one."""

        def ready() -> Opened:
            opened = in_worker(unpacked, design)
            hull_of(opened.layout)  # what is drawn of it takes its time
            return opened

        self._deferred.make(ready, partial(self._take_link, wrench), "open")

    def open_beside(self, name: str, content: bytes) -> None:
        """A design from a file that the browser sent, to stand beside this robot."""

        def read() -> Opened:
            opened = in_worker(files.read_layout, name, content)
            if isinstance(opened, Unanswered):
                asked = "; ".join(question.why for question in opened.questions)
                raise FinlabError(
                    f"{name} leaves something open ({asked}); open it by itself first, save it, "
                    "then put the saved file beside"
                )
            return opened

        self._read_beside(read, f"File: {name}")

    def open_link_beside(self, text: str) -> None:
        """The design in a link that a user has pasted, to stand beside this robot; the wrench
        stays."""
        design, _, _ = files.parts_of_link(text.rpartition("#")[2])
        self._read_beside(partial(in_worker, unpacked, design), "")

    def _read_beside(self, read: Callable[[], Opened], title: str) -> None:
        """A robot that stands at the right of this one, under a title; by its name where that is
        empty."""

        def ready() -> Opened:
            opened = read()
            hull_of(opened.layout)
            return opened

        def take(opened: Opened) -> None:
            layout = opened.layout
            own_title = title or f"Link: {layout.name}"
            self._session.two_robots.welcome("right", own_title, layout, opened.lost)
            if opened.notes:
                self._notify(
                    f"Opened {layout.name}",
                    ". ".join(note.sentence for note in opened.notes),
                    calm=True,
                )

        self._deferred.make(ready, take, "beside")

    def _take_pair(self, wrench: str, both: tuple[Opened, Opened]) -> None:
        """Puts the two robots of a link beside each other."""
        left, right = both
        self._take_link(wrench, left)
        title = f"Link: {right.layout.name}"
        self._session.two_robots.show_pair(title, right.layout, right.lost)

    def _take_link(self, wrench: str, opened: Opened) -> None:
        """Puts the design of a link on the page, with the wrench that comes with it."""
        before = self._session.state
        self._session.open_layout(opened.layout, lost=opened.lost)
        text = f"{opened.layout.name} is a copy; whoever shared it does not see what you change"
        self._notify("Opened from a link", _with(text, self._what_else(before)), calm=True)
        if wrench:
            self._session.ask_for(wrench.split(","))
        self._tell_missing(opened)

    def take(self, opened: Opened, source: SourceFile) -> None:
        """Puts the design of a file on the page, and says what to know of it."""
        session = self._session
        before = session.state
        session.open_layout(opened.layout, lost=opened.lost, **rows_of(opened, source))
        reminder = self._what_else(before)
        if reminder:
            self._notify(f"Opened {opened.layout.name}", reminder, calm=True)
        open_rows = [row for row in session.state.granted if not row.is_settled(opened.layout)]
        if open_rows:
            session.show_task("Design")
            count = f"{len(open_rows)} things were" if len(open_rows) > 1 else "One thing was"
            text = f"{count} taken for granted: see that list in Design"
            self._notify(f"Opened {opened.layout.name}", _with(text, reminder), calm=True)
        self._tell_missing(opened)

    def _tell_missing(self, opened: Opened) -> None:
        """Says which files of a design did not come along."""
        reminder = self._session.guide.reminder
        for file in opened.missing:
            text = (
                f"{file} did not come along, so a hull that fits is drawn; put both into one ZIP "
                "archive"
            )
            self._notify("Without its hull", _with(text, reminder))

    def save(self) -> None:
        """Send the design's file to the browser."""
        layout = self._session.state.layout

        def send(file: tuple[str, bytes]) -> None:
            reminder = self._session.guide.reminder
            self._download(*file, reminder)
            self._session.saved = layout

        self._deferred.make(partial(files.layout_file, layout), send, "save")

    def share(self) -> None:
        """Show the link that carries the design, and take it to the clipboard where the browser
        lets us."""
        state = self._session.state
        layout = state.layout

        def show(text: str) -> None:
            wrench = WRENCH + ",".join(f"{value:.6g}" for value in state.target)
            card = json.dumps([f"Share {layout.name}", SHARED, FRAGMENT + text + wrench])
            run_script(self._client.gui, f"finlabCards.share(...{card});")

        self._deferred.make(partial(packed, layout), show, "share")

    def share_pair(self) -> None:
        """Show the link that carries both robots that stand beside each other. FinlabError: they
        are not looked at."""
        pair = self._session.two_robots.pair
        if pair is None:
            raise FinlabError(f"two robots stand beside each other at {TWO_ROBOTS}; open it first")
        left, right = [standing.state for standing in pair.both]
        is_damaged = any(state.damage != NO_DAMAGE for state in (left, right))

        def text_of_both() -> str:
            wrench = WRENCH + ",".join(f"{value:.6g}" for value in left.target)
            return FRAGMENT + packed(left.layout) + wrench + BESIDE + packed(right.layout)

        def show(text: str) -> None:
            said = SHARED_PAIR + (" What is damaged does not travel." if is_damaged else "")
            title = f"Share {' and '.join(pair.names)}"
            card = json.dumps([title, said, text])
            run_script(self._client.gui, f"finlabCards.share(...{card});")

        self._deferred.make(text_of_both, show, "share")

    def bundle(self) -> None:
        """Send the bundle for the robot: the same bytes as `finlab export --zip`. What was tried
        out on the page does not go to the robot."""
        now = self._session.state
        solver = self._solver
        shipped = State(now.layout, method=now.method)
        self._export(
            file_stem(now.layout.name) + files.BUNDLE,
            lambda: make_bundle(solver.allocator(shipped), now.lost).zip_bytes(),
        )

    def graph(self) -> None:
        """Send the graph of the robot's actuators: the same text as `finlab export --graph`."""
        layout = self._session.state.layout
        self._export(file_stem(layout.name) + files.GRAPH, lambda: graph_text(layout).encode())

    def take_home(self, key: str) -> None:
        """Send the robot in a format of others, one of `FORMATS`. FinlabError: the format cannot
        hold it."""
        form = BY_KEY[one_of(key, "format", BY_KEY)]
        question = HomeQuestion.of_state(self._session.state)
        name = form.file_name(question.layout)

        def send(written: Written) -> None:
            self._download(name, written.content, " ".join(written.notes))

        self._deferred.make(partial(form.write, question), send, name)

    def save_modes(self, answer: Allocation, modes: Modes) -> None:
        """Send the candidates of an answer as CSV."""
        name = file_stem(answer.layout.name) + files.CANDIDATES
        self._export(name, partial(modes_csv, answer, modes))

    def save_capability(self, plot: Capability, make: Callable[[], tuple[str, bytes]]) -> None:
        """Send a capability plot as a file; `make` gives its suffix and content, on a thread."""
        stem = file_stem(plot.layout) + files.CAPABILITY

        def send(made: tuple[str, bytes]) -> None:
            suffix, content = made
            self._download(f"{stem}.{suffix}", content)

        self._deferred.make(make, send, stem)

    def swim(self, swimming: Swimming) -> None:
        """Send the log of the robot that swims as NPZ."""
        log = swimming.log()
        swimmer = swimming.swimmer
        assert swimmer is not None
        name = file_stem(f"{swimmer.layout.name}_{swimmer.method}_{swimmer.about}")
        self._export(f"{name}.npz", log.npz)

    def _export(self, name: str, make: Callable[[], bytes]) -> None:
        """Sends a file of a name to the browser, once its content is made on a thread."""
        self._deferred.make(make, partial(self._download, name), name)

    def _download(self, name: str, content: bytes, reminder: str = "") -> None:
        """Sends a file to the browser, and says so."""
        self._client.send_file_download(name, content, save_immediately=True)
        text = _with(f"{name}, among the downloads of this browser", reminder)
        self._notify("Saved", text, calm=True)


def changed_words(before: State, now: State) -> str:
    """What another robot changed of how it is asked; nothing where it changed nothing."""
    words = []
    if now.method != before.method:
        words.append(f"method {before.method} does not take this robot, {now.method} answers")
    if now.policy != before.policy:
        words.append(f"out of reach the policy is {now.policy} again, not {before.policy}")
    return "; ".join(words)


def _with(text: str, reminder: str) -> str:
    """A text with a reminder as a sentence after it; either may be empty."""
    return ". ".join([part.removesuffix(".") for part in (text, reminder) if part])


class Opening:
    """The kinds of files that one page opens, and who takes each."""

    def __init__(self, presses: Presses) -> None:
        self._takers: dict[str, Take] = {}
        presses.on("dropped", _refuse)

    @property
    def suffixes(self) -> str:
        """Suffixes of all files that can be opened, as a browser expects them."""
        return ",".join(self._takers)

    def add(self, suffixes: str, take: Take) -> None:
        """Files whose names end so (`.csv,.txt`) are for `take`."""
        self._takers |= dict.fromkeys(suffixes.split(","), take)

    def open(self, name: str, content: bytes) -> None:
        """A file that the browser has sent. FinlabError: it is of no kind that is opened, or
        whoever takes it refuses it."""
        suffix = PurePath(name).suffix.lower()
        robot = suffix in TABLES and in_worker(is_robot_table, content)
        take = self._takers.get(".yaml" if robot else suffix)
        if take is None:
            raise FinlabError(f"{PurePath(name).name[-60:]!r} cannot be opened; expected {KINDS}")
        take(name, content)


def _refuse(_key: str, _text: str) -> None:
    """What several files, or a folder, get for an answer."""
    raise FinlabError(
        "one file can be dropped at a time; put a design and its files into one ZIP archive"
    )
