"""Stand-ins: an allocator without a trained network, a silent page, a bell without a page, a user's
hand."""

import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.allocation.baselines.sqp import Sqp, SqpSettings
from finlab.allocation.method import LeastErrorMethod, Settings, number
from finlab.allocation.methods import METHODS, MethodChoice
from finlab.allocation.solution import Candidates, Solution
from finlab.errors import AllocationError, FinlabError
from finlab.layout import Layout
from finlab.physics import Plant
from finlab.physics.objective import costs
from finlab.research.networks.trained import TrainedWeights
from webapp.session import Session
from webapp.tasks.context import Context
from webapp.tasks.slot import Attended, Bell, Deferred, Pool, Pools, Slot
from webapp.tasks.solver import Solver

N_REFINED = 4
"""Candidates that are refined."""
Array = NDArray[np.float64]


@dataclass(frozen=True)
class StandInSettings(Settings):
    """What can be set of it."""

    n_candidates: int = number(64, 1, 4096, "samples")
    temperature: float = number(0.02, 0.0, 100.0, "width of the samples")
    gamma: float = number(0.01, 0.0, 1.0, "without effect")


class StandIn(LeastErrorMethod):
    """Answers of `sqp` for power and for effort as candidates, noise around them as samples."""

    name = "mdn"
    settings_class = StandInSettings
    settings: StandInSettings

    def __init__(
        self,
        layout: Layout,
        settings: Settings,
        scale: Array,
        networks: TrainedWeights | None = None,
    ) -> None:
        """Settings as method `mdn` has them; the temperature widens the samples."""
        super().__init__(layout, settings, scale, networks)
        self._inner = Sqp(layout, SqpSettings(n_starts=1), scale)
        self._other = Sqp(layout, SqpSettings(n_starts=1, objective="effort"), scale)

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        if len(targets) > 1:  # a policy asks for many at once, and for commands alone
            return self._inner._solve(targets, seed=seed, previous=None)
        refined, sampled, chosen = self._drawn(targets, seed)
        samples = self._ranked(sampled, targets[0], chosen)
        candidates = self._ranked(refined, targets[0], np.arange(N_REFINED))
        return Solution(
            candidates.command[:1], candidates=lambda: candidates, samples=lambda: samples
        )

    def _drawn(self, targets: Array, seed: int) -> tuple[Array, Array, NDArray[np.int64]]:
        """Refined commands, samples about them, and about which each is."""
        layout = self.layout
        methods = (self._inner, self._other)
        starts = [
            methods[k % 2]._solve(targets, seed=seed, previous=None) for k in range(N_REFINED)
        ]
        refined = np.concatenate([start.command for start in starts])
        rng = np.random.default_rng(seed)
        chosen = rng.integers(0, N_REFINED, self.settings.n_candidates)
        noise = rng.normal(size=(self.settings.n_candidates, layout.n_fins, 3)) * (
            0.05 + self.settings.temperature
        )
        sampled = np.clip(refined[chosen] + noise * [0.5, 1.5, 2.0], layout.lower, layout.upper)
        return refined, sampled, chosen

    def refinement(self, target: Array, *, flow: Array | None, seed: int) -> tuple[Candidates, ...]:
        refined, sampled, chosen = self._drawn(target[None], seed)
        ways = sampled, 0.5 * (sampled + refined[chosen]), refined[chosen]
        return tuple(self._judged(way, target, chosen) for way in ways)

    def _ranked(self, command: Array, target: Array, component: NDArray[np.int64]) -> Candidates:
        found = self._judged(command, target, component)
        return found.rows(np.argsort(100.0 * found.err_norm**2 + 1e-4 * found.effort).tolist())

    def _judged(self, command: Array, target: Array, component: NDArray[np.int64]) -> Candidates:
        wrench = Plant(self.layout).wrench(command)
        error = np.linalg.norm((wrench - target) / self.scale, axis=-1)
        source = tuple(f"component {k + 1}" for k in component.tolist())
        return Candidates(command, wrench, error, *costs(self.layout, command), source)


def load_stand_in(method: str = "dual", *, checkpoint: Any = None) -> MethodChoice:
    """As `choose_method`: `dual` and `mdn` are the stand-in, `ipopt` fails, the rest is `sqp`."""
    if method == "ipopt":
        raise AllocationError("ipopt is out of order in this test")
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r}")
    if method in ("dual", "mdn"):
        return MethodChoice(StandIn, StandInSettings())
    return MethodChoice(Sqp, SqpSettings())


class SilentClient:
    """Stands for a browser: the server's own scene and panel, and a camera that takes
    everything."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.scene = server.scene
        self.gui = server.gui
        self.atomic = server.atomic
        self.camera = type("Camera", (), {})()
        self.kept: dict[str, str] = {}
        self.local_storage = SimpleNamespace(set_item=self.kept.__setitem__, get_item=self.kept.get)
        self.notes: list[str] = []
        self.flush = server.flush
        self.files: dict[str, bytes] = {}

    def add_notification(self, title: str, body: str, **_: Any) -> None:
        """Note what the user would have been told."""
        self.notes.append(f"{title}: {body}")

    def send_file_download(self, name: str, content: bytes, **_: Any) -> None:
        """Keep what the user would have saved."""
        self.files[name] = content


def turn_fin(session: Session, name: str, angle: float) -> None:
    """Select a fin and turn it to an angle [rad]."""
    session.select(name)
    session.turn_selected(angle)


class Direct(Pool):
    """Does all where it is asked for."""

    def __init__(self) -> None:
        """No thread is needed."""

    def submit(self, work: Callable[[], Any]) -> "Future[Any]":
        """Do it now."""
        future: Future[Any] = Future()
        try:
            future.set_result(work())
        except Exception as error:
            future.set_exception(error)
        return future

    def do_now(self, work: Callable[[], Any]) -> "Future[Any]":
        """As all is done."""
        return self.submit(work)

    def stop(self) -> None:
        """There is nothing to end."""


@dataclass
class LaterCall:
    """A call that is still to come, in place of `asyncio.TimerHandle`."""

    due: float
    """When it is made, by the monotonic clock [s]."""
    act: Callable[[], object]
    is_cancelled: bool = False

    def cancel(self) -> None:
        """The call is not made any more."""
        self.is_cancelled = True


class LoneBell(Bell):
    """A bell without a page: a test looks itself, by `attend` or `until`."""

    all: ClassVar[list["LoneBell"]] = []

    def __init__(self) -> None:
        """Nobody has rung."""
        self._rung: deque[Attended] = deque()
        self._later: list[LaterCall] = []
        self.refused: list[str] = []
        """What the page would have told the user."""
        self.stages: list[Any] = []
        """How far what has rung was."""
        LoneBell.all.append(self)

    def ring(self, *waiting: Attended) -> None:
        """Keep who has rung."""
        self._rung.extend(waiting)

    def ring_from_thread(self, waiting: Attended, _done: object = None) -> None:
        """Keep who has rung."""
        self._rung.append(waiting)

    def call_later(self, seconds: float, act: Callable[[], object]) -> "LaterCall":
        """Keep what is called later."""
        self._later.append(LaterCall(time.monotonic() + seconds, act))
        return self._later[-1]

    def attend(self) -> None:
        """Let all go on that have rung by now, as a page does."""
        waiting_calls = [call for call in self._later if not call.is_cancelled]
        self._later = []
        for call in waiting_calls:
            if call.due > time.monotonic():
                self._later.append(call)
            else:
                call.act()
        for _ in range(len(self._rung)):
            waiting = self._rung.popleft()
            try:
                came = waiting.attend()
            except FinlabError as error:
                self.refused.append(str(error))
                continue
            if came and isinstance(waiting, Slot):
                self.stages.append(waiting.progress)
                if waiting.is_error_new:
                    self.refused.append(f"{waiting.title}: {waiting.error}")


def context_of(pool: Pool, session: Any = None, solver: Solver | None = None) -> Context:
    """Tasks that do all their work on one pool, with the stand-in allocator unless told
    otherwise."""
    pools = Pools(answers=pool, swims=pool, brief=pool, long=pool)
    return Context(session, solver or Solver(load=load_stand_in), pools, LoneBell())


class AtOnce(Deferred):
    """Makes everything where it is asked to."""

    def __init__(self) -> None:
        """No page is needed."""

    def make(self, work: Any, use: Callable[[Any], object], kind: Any = "") -> None:
        """Make it now."""
        use(work())


def until(condition: Callable[[], bool]) -> None:
    """Wait for something; what has rung without a page goes on meanwhile."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        for bell in LoneBell.all:
            bell.attend()
        time.sleep(0.005)


class Node(SimpleNamespace):
    """A node that keeps what it is told."""

    def __getattr__(self, name: str) -> Any:
        """Nothing was told."""
        return None


class Recorded:
    """A scene of such nodes."""

    def __getattr__(self, name: str) -> Any:
        return lambda *_, **options: Node(**options)
