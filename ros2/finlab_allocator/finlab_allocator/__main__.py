"""Starts the node: `python -m finlab_allocator --ros-args -p robot:=NAME`."""

import gc
import os
import signal
import sys
from threading import Event, Thread

# Before numpy is loaded: every product here is too small to be shared among cores.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import rclpy  # noqa: E402
from rclpy.executors import Executor, SingleThreadedExecutor  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402
from rclpy.utilities import try_shutdown  # noqa: E402

from finlab.errors import EXIT_ERROR, FinlabError  # noqa: E402
from finlab_allocator.node import AllocatorNode  # noqa: E402

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end the node, after a last neutral command."""


def main(arguments: list[str] | None = None) -> int:
    """Runs the node until a signal.

    Args:
        arguments: those of the command line, with what ROS reads of them; `sys.argv` when None.

    Returns:
        The exit code: 0 after a signal, 2 after one sentence about a robot or a parameter.
    """
    # Blocked in each thread, and waited for in one of its own: a handler in Python would run only
    # when the executor, which waits in C, comes back; and ROS's own would close the publishers.
    signals = [each for each in SIGNALS if signal.getsignal(each) != signal.SIG_IGN]
    signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    try:
        return _run(signals)
    except FinlabError as error:
        print(f"finlab_allocator: error: {error}", file=sys.stderr)
        return EXIT_ERROR
    finally:
        try_shutdown()


def _run(signals: list[signal.Signals]) -> int:
    """Runs the node until one of some signals. Raises FinlabError: a parameter is refused."""
    executor = SingleThreadedExecutor()
    is_stopped = Event()
    Thread(target=_wait, args=(signals, is_stopped, executor), daemon=True).start()
    node = AllocatorNode()
    if node.settings.autostart:
        if node.trigger_configure() != TransitionCallbackReturn.SUCCESS:
            return EXIT_ERROR  # the node has said why
        node.trigger_activate()
    executor.add_node(node)
    # What is here now stays: the garbage collector need not walk through it at a wrench.
    gc.collect()
    gc.freeze()
    try:
        while not is_stopped.is_set():  # a future to spin for would grow with each message
            executor.spin_once()
    finally:
        node.stop()
        executor.remove_node(node)
        node.destroy_node()
    return 0


def _wait(signals: list[signal.Signals], is_stopped: Event, executor: Executor) -> None:
    """Waits for the first signal; a second one ends the process at once."""
    signal.sigwait(signals)
    is_stopped.set()
    executor.create_task(lambda: None)  # wakes it
    os._exit(128 + signal.sigwait(signals))


if __name__ == "__main__":
    sys.exit(main())
