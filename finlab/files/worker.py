"""Reads a file of a stranger in a process of its own, within limits of processor time and memory.

A parser that loops or allocates without bound then ends that process, and not the app or the
command line; the caller gets one sentence.
"""

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

CPU_S = 1.8
"""Processor time that reading a small file may take [s]."""
CPU_S_PER_BYTE = 0.6e-6
"""Processor time for each byte of a large file [s]; a mesh takes 0.35e-6."""
MEMORY_BYTES = 150_000_000
"""Memory that reading a small file may take, beyond the 110 MB of the process before [bytes]."""
MEMORY_PER_BYTE = 50
"""Memory for each byte of a large file [bytes]; a GLB mesh takes 46."""
WALL_OVER_CPU = 20.0
"""Wall time over the limit of processor time after which the process is ended although it has not
used its processor time: it waits for something that never comes."""

Result = TypeVar("Result")


class _Limits(NamedTuple):
    """What reading one file may take."""

    seconds: float
    """Processor time [s]."""
    memory: int
    """Memory beyond that of the process before [bytes]."""


def in_worker(read: Callable[..., Result], *arguments: Any) -> Result:
    """Returns the result of `read(*arguments)`, which runs in a process of its own.

    What it changes in its arguments stays in that process. A program of one thread is forked; any
    other one has a fork server, so that its main module must be guarded by `if __name__ ==
    "__main__"`.

    Args:
        read: a function of a module.
        arguments: its arguments. Limits grow with the size of the files among them, as bytes or by
            their paths.

    Raises:
        FinlabError: `read` raised it, took too much time or memory, or failed.
    """
    size = sum(map(_size, arguments))
    limits = _Limits(max(CPU_S, CPU_S_PER_BYTE * size), max(MEMORY_BYTES, MEMORY_PER_BYTE * size))
    context: Any = _context()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(
        target=_run_child, args=(sender, limits, read, arguments), daemon=True
    )
    with receiver:
        try:
            process.start()
            sender.close()
            if not receiver.poll(WALL_OVER_CPU * limits.seconds):
                raise _error_of_exit(-signal.SIGKILL, limits)
            answer, error = receiver.recv()
        except EOFError:
            process.join()
            answer = None
            error = _error_of_exit(process.exitcode, limits)
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
    """Lets this process end as soon as the one that started it has, however that ended."""
    parent = multiprocessing.parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def prepare(modules: Sequence[str]) -> None:
    """Starts the fork server, with modules imported, before the first file comes."""
    multiprocessing.set_forkserver_preload(list(modules))
    with suppress(OSError, ValueError):
        from multiprocessing.forkserver import ensure_running

        ensure_running()


def _context() -> Any:
    """How a process is started: by fork where no thread of ours could hold a lock."""
    if threading.active_count() == 1 and sys.platform == "linux":
        return multiprocessing.get_context("fork")
    has_fork_server = "forkserver" in multiprocessing.get_all_start_methods()
    return multiprocessing.get_context("forkserver" if has_fork_server else None)


def _size(argument: Any) -> int:
    """Size of the files in an argument [bytes]: bytes, a path of a file or folder, or a list."""
    if isinstance(argument, bytes):
        return len(argument)
    if isinstance(argument, (list, tuple)):
        return sum(map(_size, argument))
    with suppress(OSError, TypeError, ValueError):
        if os.path.isdir(argument):
            return sum(map(os.path.getsize, Path(argument).iterdir()))
        return os.path.getsize(argument)
    return 0


def _run_child(
    connection: Connection, limits: _Limits, read: Callable[..., Any], arguments: Any
) -> None:
    """The body of the process: sends the result, or the error, and ends."""
    # Memory may not suffice to send an error; whoever interrupts, interrupts both processes.
    with suppress(BaseException):
        _set_limits(limits)
        connection.send(_answer(read, arguments))
    os._exit(1)


def _answer(read: Callable[..., Any], arguments: Any) -> tuple[Any, FinlabError | None]:
    """The result of reading, or the error in its place."""
    try:
        return read(*arguments), None
    except FinlabError as problem:
        return None, problem
    except MemoryError:
        raise
    except Exception as problem:  # a fault of ours; a stranger's file has no power by it
        frame = traceback.extract_tb(problem.__traceback__)[-1]
        text = (
            f"{type(problem).__name__} in {Path(frame.filename).name}, line {frame.lineno}: "
            f"{problem!s:.100}"
        )
        return None, FinlabError(
            f"reading failed, a fault of finlab ({text}); report it with the file"
        )


def _set_limits(limits: _Limits) -> None:
    """Sets the limits of this process, where the system has them."""
    with suppress(ImportError, OSError, ValueError):  # not every system has all
        import resource

        used = resource.getrusage(resource.RUSAGE_SELF)
        seconds = math.ceil(used.ru_utime + used.ru_stime + limits.seconds)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, limits.seconds)  # the other one counts whole seconds
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        resource.setrlimit(
            resource.RLIMIT_AS, (pages * resource.getpagesize() + limits.memory,) * 2
        )


def _error_of_exit(code: int | None, limits: _Limits) -> FinlabError:
    """The error for a process that has ended without an answer, by its exit code."""
    is_timeout = code in (-signal.SIGPROF, -signal.SIGXCPU, -signal.SIGKILL)
    if is_timeout:
        excess = f"time, more than {limits.seconds:.1f} s"
    else:
        excess = f"memory, over {limits.memory / 1e6:.0f} MB"
    return FinlabError(f"reading the file takes too much {excess}; make it smaller or simpler")
