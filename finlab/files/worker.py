"""A process that reads a file of a stranger, within limits of processor time and memory."""

import math
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from finlab.errors import FinlabError

CPU_S, CPU_S_PER_BYTE = 1.8, 0.6e-6
"""Processor time of a small file [s], and of each byte of a large one: a mesh takes 0.35 s per
megabyte."""
ROOM, ROOM_PER_BYTE = 150_000_000, 50
"""Memory that reading a small file may take [bytes], and each byte of a large one: a GLB mesh takes
46. The process has about 110 MB before."""
PATIENCE = 20.0
"""Times the processor time after which the process is ended although it has not used it."""

Result = TypeVar("Result")


class _Limits(NamedTuple):
    seconds: float
    room: int


def in_worker(read: Callable[..., Result], *arguments: Any) -> Result:
    """Returns what `read(*arguments)` gives, which runs in a process of its own.

    What it changes in its arguments stays there. A program of one thread is copied; any other one
    has a process that is copied, so that its main module must be guarded by `if __name__ ==
    "__main__"`. `read` is a function of a module, for the files that the arguments are (bytes) or
    name (paths); with their size the limits grow. Raises FinlabError: so did `read`; or it took too
    much time or memory, or failed."""
    size = sum(map(_size, arguments))
    limits = _Limits(max(CPU_S, CPU_S_PER_BYTE * size), max(ROOM, ROOM_PER_BYTE * size))
    context: Any = _context()
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(there, limits, read, arguments), daemon=True)
    with here:
        try:
            process.start()
            there.close()
            if not here.poll(PATIENCE * limits.seconds):
                raise _ended(-signal.SIGKILL, limits)
            answer, error = here.recv()
        except EOFError:
            process.join()
            answer = None
            error = _ended(process.exitcode, limits)
        except OSError as problem:
            raise FinlabError(
                f"no process can be started to read the file: {problem.strerror}"
            ) from None
        finally:
            if process.pid is not None:
                process.kill()
                process.join()
    if error is not None:
        raise error
    result: Result = answer
    return result


def end_with_parent() -> None:
    """Let this process end as soon as the one that started it has, however that ended."""
    parent = multiprocessing.parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def prepare(modules: Sequence[str]) -> None:
    """Let the process that is copied be ready, with modules imported, before the first file
    comes."""
    multiprocessing.set_forkserver_preload(list(modules))
    with suppress(OSError, ValueError):
        from multiprocessing.forkserver import ensure_running

        ensure_running()


def _context() -> Any:
    alone = threading.active_count() == 1 and sys.platform == "linux"
    methods = multiprocessing.get_all_start_methods()
    return multiprocessing.get_context(
        "fork" if alone else "forkserver" if "forkserver" in methods else None
    )


def _size(argument: Any) -> int:
    if isinstance(argument, (bytes, list, tuple)):
        return len(argument) if isinstance(argument, bytes) else sum(map(_size, argument))
    with suppress(OSError, TypeError, ValueError):
        if os.path.isdir(argument):
            return sum(map(os.path.getsize, Path(argument).iterdir()))
        return os.path.getsize(argument)
    return 0


def _child(
    connection: Connection, limits: _Limits, read: Callable[..., Any], arguments: Any
) -> None:
    # Memory may not even suffice to say so; whoever interrupts, interrupts both.
    with suppress(BaseException):
        _limit(limits)
        connection.send(_answer(read, arguments))
    os._exit(1)


def _answer(read: Callable[..., Any], arguments: Any) -> tuple[Any, FinlabError | None]:
    try:
        return read(*arguments), None
    except FinlabError as problem:
        return None, problem
    except MemoryError:
        raise
    except Exception as problem:  # a fault of ours; a stranger's file has no power by it
        at = traceback.extract_tb(problem.__traceback__)[-1]
        text = (
            f"{type(problem).__name__} in {Path(at.filename).name}, line {at.lineno}: "
            f"{problem!s:.100}"
        )
        return None, FinlabError(
            f"reading failed, a fault of finlab ({text}); report it with the file"
        )


def _limit(limits: _Limits) -> None:
    with suppress(ImportError, OSError, ValueError):  # not every system has all
        import resource

        used = resource.getrusage(resource.RUSAGE_SELF)
        seconds = math.ceil(used.ru_utime + used.ru_stime + limits.seconds)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, limits.seconds)  # the other one counts whole seconds
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + limits.room,) * 2)


def _ended(code: int | None, limits: _Limits) -> FinlabError:
    """Why the process has ended without a word."""
    late = code in (-signal.SIGPROF, -signal.SIGXCPU, -signal.SIGKILL)
    why = (
        f"time, more than {limits.seconds:.1f} s"
        if late
        else f"memory, over {limits.room / 1e6:.0f} MB"
    )
    return FinlabError(f"reading the file takes too much {why}; make it smaller or simpler")
