"""Robots of mixed numbers of fins in one batch: padded to n fins, or the rows of their fins alone.

What works on each fin by itself, such as a linear layer, takes the rows, a good third fewer; what
relates the fins of a robot takes the padded form. Only training has such batches, of tensors.
"""

from dataclasses import dataclass

from finlab.arrays import Values, library_of

BLOCK = 64
"""Rows come in whole blocks: with each new number of rows, torch's bfloat16 products on a processor
compile a new kernel."""


@dataclass(frozen=True)
class Padding:
    """Where the fins of a batch of robots are."""

    mask: Values
    """(B, n), True where there is a fin."""
    index: Values
    """Their numbers (M,) among the B n places; padding fills up the last block."""

    @classmethod
    def of(cls, mask: Values) -> "Padding":
        """Returns the padding of a mask (B, n)."""
        flat = mask.flatten()
        fins = flat.nonzero().flatten()
        missing = -len(fins) % BLOCK
        others = (~flat).nonzero().flatten()[:missing]
        return cls(mask, library_of(mask).cat([fins, others]))

    def rows(self, padded: Values) -> Values:
        """Returns the rows (M, ...) of padded values (B, n, ...)."""
        return padded.flatten(0, 1).index_select(0, self.index)

    def rows_of_robots(self, values: Values) -> Values:
        """Returns the row (M, ...) of its robot for each fin, from values (B, ...)."""
        return values.index_select(0, self.index // self.mask.shape[1])

    def padded(self, rows: Values) -> Values:
        """Returns the padded form (B, n, ...) of rows (M, ...): 0 where no row is."""
        places = rows.new_zeros(self.mask.numel(), *rows.shape[1:])
        return places.index_copy(0, self.index, rows).unflatten(0, self.mask.shape)
