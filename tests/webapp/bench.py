"""Load and soak: `python -m tests.webapp.bench [changes]` on a real server, with pages that take everything.

Not a test. It measures what the server does: from a change of the wrench to the new page contents being
handed to viser. What a browser adds depends on its graphics card.
"""

import asyncio
import contextlib
import resource
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import viser

from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from webapp.session import Session
from webapp.tasks.background import Workers
from webapp.tasks.solver import Solver
from webapp.view import View
from webapp.viser_internals import start_server, stop_server

SESSIONS = 8
LAYOUT = "penta"


class SilentClient:
    """Stands for a browser: the server's own scene and panel, and a camera that takes everything."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.scene, self.gui, self.atomic = server.scene, server.gui, server.atomic
        self.camera = type("Camera", (), {})()
        self.kept: dict[str, str] = {}
        self.local_storage = SimpleNamespace(set_item=self.kept.__setitem__, get_item=self.kept.get)
        self.notes: list[str] = []
        self.files: dict[str, bytes] = {}

    def add_notification(self, title: str, body: str, **_: Any) -> None:
        """Note what the user would have been told."""
        self.notes.append(f"{title}: {body}")

    def send_file_download(self, name: str, content: bytes, **_: Any) -> None:
        """Keep what the user would have saved."""
        self.files[name] = content


class Bench:
    """A server per session, so that no page's nodes replace those of another one."""

    def __init__(self, solver: Solver, n_sessions: int = SESSIONS) -> None:
        """Open the pages."""
        self.workers = Workers()
        self.servers = [start_server() for _ in range(n_sessions)]
        layout = load_layout(shipped_layouts()[LAYOUT])
        self.views: list[View] = []
        for server in self.servers:
            client: Any = SilentClient(server)
            loop = server.get_event_loop()
            make = partial(View, client, Session(layout), solver, self.workers, loop)
            self.views.append(self.on_loop(len(self.views), make))

    def on_loop(self, k: int, act: Callable[[], Any]) -> Any:
        """Run on the event loop of page `k`, and wait for it."""

        async def run() -> Any:
            return act()

        return asyncio.run_coroutine_threadsafe(run(), self.servers[k].get_event_loop()).result(60)

    def settle(self) -> None:
        """Wait until every page shows the answer to its newest question."""
        while any(view.busy or view.analyst.busy for view in self.views):
            time.sleep(0.005)

    def nodes(self) -> int:
        """Scene nodes and widgets of all pages."""
        return sum(
            len(server.scene._handle_from_node_name) + len(server.gui._gui_input_handle_from_uuid)
            for server in self.servers
        )

    def respond(self, n: int, rng: np.random.Generator) -> list[float]:
        """Times [ms] from a change on one page, while the others rest, to its answer on the page."""
        view, times = self.views[0], []
        for _ in range(n):
            value = float(rng.uniform(-1, 1))
            start = time.perf_counter()
            self.on_loop(0, partial(view.do, partial(view.session.set_target, 0, value)))
            while view.busy:
                time.sleep(0.0005)
            times.append(1000 * (time.perf_counter() - start))
        return times

    def soak(self, changes: int, rng: np.random.Generator) -> None:
        """Change the wrench of all pages in turn, as fast as the server takes it."""
        for k in range(changes):
            page, axis, value = k % len(self.views), int(rng.integers(6)), float(rng.uniform(-1, 1))
            view = self.views[page]
            self.on_loop(page, partial(view.do, partial(view.session.set_target, axis, value)))
        self.settle()

    def close(self) -> None:
        """Stop everything."""
        for k, view in enumerate(self.views):
            self.on_loop(k, view.close)
        self.workers.stop()
        for server in self.servers:
            stop_server(server)


def memory() -> float:
    """Memory of this process now [MB]."""
    with contextlib.suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main(changes: int) -> None:
    """Print the figures."""
    rng = np.random.default_rng(0)
    bench = Bench(Solver())
    bench.settle()
    computing = time.process_time()
    times = bench.respond(200, rng)
    computing = 1000 * (time.process_time() - computing) / len(times)
    p50, p95 = np.percentile(times, [50, 95])
    print(f"one page, {LAYOUT}: change to answer on the page: median {p50:.1f} ms, p95 {p95:.1f} ms")
    # What a machine with nothing else to do would need at most; waiting for a processor does not count.
    print(f"computing per change, all threads together: {computing:.1f} ms", flush=True)
    bench.soak(changes // 10, rng)
    nodes, megabytes, start = bench.nodes(), memory(), time.perf_counter()
    bench.soak(changes, rng)
    took = time.perf_counter() - start
    print(f"{SESSIONS} pages, {changes} changes: {took:.0f} s, {changes / took:.0f} changes/s")
    print(f"memory: {megabytes:.0f} MB before, {memory():.0f} MB after")
    print(f"nodes and widgets: {nodes} before, {bench.nodes()} after")
    bench.close()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
