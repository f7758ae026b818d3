"""Arrays that Python and the core both read and write."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own


class SharedArray:
    """An array of numbers with its address, which is looked up once and not at every call.

    A copy has numbers of its own, at an address of their own.
    """

    __slots__ = ("address", "array")

    def __init__(self, values: ArrayLike) -> None:
        """Copies values (...)."""
        self.array: Array = np.array(values, dtype=np.float64, order="C")
        """The numbers (...); to be changed in place."""
        self.address: int = self.array.ctypes.data
        """Where they stand."""

    def __copy__(self) -> "Self":
        return type(self)(self.array)

    def __deepcopy__(self, memo: object) -> "Self":
        return type(self)(self.array)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.array,)
