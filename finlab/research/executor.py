"""An executor of independent parts: this process, several processes, or the workers of a Dask
cluster.

Results come in the order of the parts, wherever and however often these were computed: a part is
one call of one function, whose result depends on its argument alone.
"""

import logging
import multiprocessing
import os
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, TypeVar

from tqdm import tqdm

from finlab.errors import FinlabError
from finlab.files.worker import end_with_parent

if TYPE_CHECKING:
    from distributed import Client, Future

Part = TypeVar("Part")
Made = TypeVar("Made")

PATIENCE_S = 10.0
"""How long a scheduler may take to answer, and a cluster that has lost all workers to have another
[s]."""
_client: ContextVar["Client | None"] = ContextVar("client", default=None)


def map_parts(
    function: Callable[[Part], Made],
    parts: Sequence[Part],
    what: str | None = None,
    unit: str = "part",
    jobs: int = 1,
) -> Iterator[Made]:
    """Yields `function(part)` of each part, in order.

    Inside `on_cluster` the parts run there, else in at most `jobs` processes, 1 being this one;
    those still open are dropped when the iteration ends early. A function of a module, or a
    `partial` of one, and parts that can be pickled can be sent. With a title `what` there is a bar
    on a terminal's stderr, which counts units. Raises FinlabError: the cluster is gone, a part ends
    every worker, or a process of this machine has ended; and whatever `function` raises."""
    client = _client.get()
    count = len(parts)
    jobs = min(jobs, count)
    if client is not None:
        made = _by_cluster(client, function, parts)
    else:
        made = _by_processes(function, parts, jobs) if jobs > 1 else map(function, parts)
    disable = None if what else True  # None: a bar on a terminal, nothing elsewhere
    yield from tqdm(made, what, count, unit=unit, disable=disable, leave=False, file=sys.stderr)


def cores() -> int:
    """Processes that this machine has room for."""
    return os.cpu_count() or 1


@contextmanager
def on_cluster(address: str | None) -> Iterator[None]:
    """Let `map_parts` use the workers of a Dask cluster; nothing changes without an address.
    FinlabError: nobody answers there, there are no workers, or they have another finlab."""
    if address is None:
        yield
        return
    client = _connected(address)
    token = _client.set(client)
    try:
        yield
    finally:
        _client.reset(token)
        client.close(timeout=PATIENCE_S)


def _connected(address: str) -> "Client":
    from distributed import Client

    logging.getLogger("distributed.client").setLevel(
        logging.CRITICAL
    )  # what is lost is said in a sentence
    try:
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FinlabError(
            f"cluster: no Dask scheduler answers at {address!r:.80} ({reason:.80}); start one with "
            "`dask scheduler` and name its address, such as tcp://desk:8786"
        ) from None
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
        versions = {str(version) for version in client.run(_version).values()}
    except ModuleNotFoundError:
        versions = {"none"}
    except TimeoutError:
        client.close()
        raise FinlabError(
            f"cluster: {address} has no workers; start `dask worker {address}`"
        ) from None
    if versions != {_version()}:
        client.close()
        raise FinlabError(
            f"cluster: expected workers with finlab {_version()}, got "
            f"{', '.join(sorted(versions))}; install the same one on each machine"
        )
    return client


def _version() -> str:
    version: str = sys.modules["finlab"].__version__
    return version


def _by_processes(
    function: Callable[[Part], Made], parts: Sequence[Part], jobs: int
) -> Iterator[Made]:
    others = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, context, end_with_parent) as pool:
        made = pool.map(function, parts)
        started = set(multiprocessing.active_children()) - others
        try:
            yield from made
        except BrokenProcessPool:
            raise FinlabError(
                "a process that computes parts has ended: give it more memory, or fewer "
                "processes; a script "
                'must be guarded by `if __name__ == "__main__":`'
            ) from None
        finally:
            for process in started:
                process.terminate()


def _by_cluster(
    client: "Client", function: Callable[[Part], Made], parts: Sequence[Part]
) -> Iterator[Made]:
    """Parts of a worker that is lost run again on another one."""
    waiting = deque(client.map(function, parts, pure=False))
    try:
        while waiting:
            yield _result(client, waiting[0])
            waiting.popleft()
    finally:
        client.cancel(list(waiting), force=True)


def _result(client: "Client", future: "Future[Any]") -> Any:
    from concurrent.futures import CancelledError

    from distributed import KilledWorker, wait

    lost = False
    try:
        while not future.done():
            try:
                with client.as_current():
                    wait(future, timeout=PATIENCE_S)
            except TimeoutError:
                before = lost
                lost = not client.scheduler_info(n_workers=-1)["workers"]
                if before and lost:
                    raise FinlabError(
                        "cluster: all workers are lost; start others and run it again"
                    ) from None
        return future.result()
    except KilledWorker:
        raise FinlabError(
            "cluster: a part ended each worker that took it; give them more memory"
        ) from None
    except CancelledError:
        raise FinlabError("cluster: its scheduler is lost; start it and run it again") from None
