"""One formula for numpy's arrays, torch's tensors and CasADi's symbols."""

import sys
from typing import Any

import numpy as np


def library_of(value: Any) -> Any:
    """Returns the module whose `sin`, `cos` ... work on `value`; numpy for arrays and plain numbers.

    Whoever made a tensor or a symbol has loaded its library; nothing is imported here.
    """
    module = type(value).__module__.partition(".")[0]
    return sys.modules[module] if module in ("torch", "casadi") else np
