"""One thread that computes; of several questions from one asker only the newest is answered."""

import threading
import traceback
from collections.abc import Callable, Hashable

from finlab.errors import FinlabError

Job = Callable[[], None]
Failed = Callable[[str], None]


class Worker:
    """Runs jobs on a thread of its own. A job that waits is replaced by a newer one with the same key.

    Askers take turns in the order in which they began to wait, so that nobody starves and nothing queues up.
    """

    def __init__(self) -> None:
        """Start the thread."""
        self._jobs: dict[Hashable, tuple[Job, Failed]] = {}
        self._wake = threading.Condition()
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name="finlab-solver", daemon=True)
        self._thread.start()

    def submit(self, key: Hashable, job: Job, failed: Failed) -> None:
        """Run `job` soon, instead of a job with the same key that has not begun yet.

        Args:
            key: who asks, and what for.
            job: what to do, on the worker's thread.
            failed: told there, in a sentence, why the job came to nothing.
        """
        with self._wake:
            self._jobs[key] = (job, failed)
            self._wake.notify()

    def forget(self, key: Hashable) -> None:
        """Drop the waiting job of an asker that has gone."""
        with self._wake:
            self._jobs.pop(key, None)

    def stop(self) -> None:
        """Finish the running job, drop the others, end the thread."""
        with self._wake:
            self._stopped = True
            self._jobs.clear()
            self._wake.notify()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._jobs or self._stopped)
                if self._stopped:
                    return
                job, failed = self._jobs.pop(next(iter(self._jobs)))
            try:
                job()
            except FinlabError as error:
                failed(str(error))
            except Exception as error:  # one asker's fault must not silence all the others
                traceback.print_exc()
                failed(f"it failed: {error or type(error).__name__}")
