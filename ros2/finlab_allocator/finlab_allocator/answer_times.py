"""The times that the last answers took, from a message in to the last one out."""

import numpy as np

TIMES_KEPT = 10_000
"""Answers whose times are kept."""


class AnswerTimes:
    """A ring of the last times: those that passed, and the processor's, which are less where other
    programs were given the processor in between."""

    def __init__(self) -> None:
        self._times_s = np.zeros((2, TIMES_KEPT))
        self.count = 0
        """How many answers there have been."""

    def add(self, passed_s: float, processor_s: float) -> None:
        """Takes the times of an answer.

        Args:
            passed_s: by the clock [s].
            processor_s: of the processor [s].
        """
        self._times_s[:, self.count % TIMES_KEPT] = passed_s, processor_s
        self.count += 1

    def quantiles_ms(self, share: float) -> tuple[float, float]:
        """Returns quantiles of the times that are kept, of which there is one at least.

        Args:
            share: of the answers that took no longer, such as 0.99.

        Returns:
            Time passed, and time of the processor [ms].
        """
        kept = min(self.count, TIMES_KEPT)
        rank = min(int(share * kept), kept - 1)
        passed, processor = np.partition(self._times_s[:, :kept], rank, axis=1)[:, rank]
        return 1e3 * float(passed), 1e3 * float(processor)
