"""What a browser has sent is read in a process of its own, which is ended in time."""

import contextlib
import multiprocessing
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from finlab.errors import FinlabError

READ_S = 15.0
"""How long a file may be read [s]; the largest valid ones take a fifth of it."""
MOST_MEMORY = 3_000_000_000
"""Address space that a file may take while it is read [bytes]."""
MOST_AT_ONCE = 3
"""Files that are read at the same time for all pages; others wait."""

Found = TypeVar("Found")
Read = Callable[[], Found]


def _context() -> Any:
    """Processes from one that has imported all that reading needs; where there is none, fresh ones."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["webapp.session.files"])
    return context


@dataclass(frozen=True)
class Readers:
    """Threads that wait for the processes; all pages share them."""

    context: Any = field(default_factory=_context)
    pool: ThreadPoolExecutor = field(
        default_factory=partial(ThreadPoolExecutor, MOST_AT_ONCE, "finlab-reader")
    )

    def warm(self) -> None:
        """Let the imports be done before the first file comes."""
        self.pool.submit(self.read, int)

    def read(self, read: Read[Found]) -> Found:
        """Call `read`, which can be pickled, in a process of its own, and wait for what it gives.

        Raises:
            FinlabError: so did it; or it took too long, too much memory, or failed.
        """
        here, there = self.context.Pipe(duplex=False)
        process = self.context.Process(target=_child, args=(there, read), daemon=True)
        with here:
            process.start()
            there.close()
            try:
                if not here.poll(READ_S):
                    raise FinlabError(
                        f"reading took more than {READ_S:g} s, and was ended; make the file smaller"
                    )
                kind, found = here.recv()
            except EOFError:
                raise FinlabError("reading failed: it took too much memory; make the file smaller") from None
            finally:
                process.kill()
                process.join()
                process.close()
        if kind == "fault":
            raise RuntimeError(found)
        if kind == "refused":
            raise FinlabError(found)
        result: Found = found
        return result

    def stop(self) -> None:
        """Take no more files."""
        self.pool.shutdown(wait=False, cancel_futures=True)


def _child(connection: Connection, read: Read[Any]) -> None:
    """In the process: read, and send what came of it."""
    with contextlib.suppress(ImportError, ValueError, OSError):  # not every system can
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    try:
        answer = "found", read()
    except FinlabError as error:
        answer = "refused", str(error)
    except MemoryError:
        answer = "refused", "reading took too much memory; make the file smaller"
    except Exception:
        answer = "fault", traceback.format_exc()
    connection.send(answer)
