"""Hot loops in C, and the way to them from Python: the compiled core as a ctypes library, loaded
once. `hatch_build.py` compiles it from the C files here."""

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import TypeVar

from finlab.errors import FinlabError

VERSION = 30
"""What `fl_version()` of the C files returns; both rise together where a signature or a struct
changes."""
SIGNATURES = {
    "fl_fields": "s",
    "fl_constant_name": "si",
    "fl_constant_value": "ii",
    "fl_error_text": "si",
    "fl_check": "ipi",
    "fl_prepare": "ipp",
    "fl_answer_one": "ipppp",
    "fl_answer_into_row": "ippprp",
    "fl_python_names": "s",
    "fl_use_python": "vpp",
    "fl_python_method": "p",
    "fl_widest_lanes": "i",
    "fl_answer_many": "ipppipipppppppp",
    "fl_commands": "vpppipp",
    "fl_forces_of_commands": "vppip",
    "fl_figures_of_command": "ipipppp",
    "fl_use_laws": "vppp",
    "fl_conjugates": "ippppipp",
    "fl_power_bounds": "ipppppipp",
    "fl_power_bound_of_row": "rppppp",
    "fl_dual_points": "ippppiipppppp",
    "fl_reach": "vpppppirppp",
    "fl_reach_within": "vpppppipppirppppp",
    "fl_jets": "vppipppp",
    "fl_line_jets_length": "ip",
    "fl_prepare_line_jets": "vpp",
    "fl_linear_interaction": "vppipppp",
    "fl_message_rows": "vppipppp",
    "fl_message_wrench": "vpipppp",
    "fl_outer_iterations": "ipppppppp",
    "fl_body_rates": "vpppp",
    "fl_body_fastest_rate": "rpp",
    "fl_body_parts": "ippr",
    "fl_body_steps": "ippirp",
    "fl_body_coarse_step": "ipprp",
    "fl_follow_fins": "vppip",
    "fl_move_fins": "vppiripp",
    "fl_follow_lags": "vppirip",
    "fl_path_wrenches": "vpppiprrp",
    "fl_kalman_predict": "vppip",
    "fl_kalman_correct": "vppiiipp",
    "fl_motion_step": "vpppiirrpppppp",
    "fl_jumps_predict": "vppppiiiiipp",
    "fl_jumps_update": "rpppirpiiiiippppp",
    "fl_jumps_of_actuators": "vpppiipiipipppppprppp",
    "fl_jumps_of_pairs": "vpppiiippprrp",
    "fl_jumps_of_wrench": "vpppiipprrp",
    "fl_log_sums": "vpiipipp",
    "fl_answer_coupled_into_row": "ipppprp",
    "fl_answer_coupled_many": "ipppppippppppp",
}
"""What each function returns and takes: i int, r real, p pointer, s text, v nothing."""
_TYPES = {
    "i": ctypes.c_int,
    "r": ctypes.c_double,
    "p": ctypes.c_void_p,
    "s": ctypes.c_char_p,
    "v": None,
}
"""Types of ctypes by the letters of `SIGNATURES`."""
_SUFFIX = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
"""Of libraries on this system."""
PATH = Path(__file__).with_name(f"libfinlab.{_SUFFIX}")
"""Where the compiled core stands."""

_Library = TypeVar("_Library", bound=ctypes.CDLL)


@cache
def library() -> ctypes.PyDLL:
    """Returns the library.

    Its functions keep the interpreter's lock: most calls take microseconds; those of coupled robots
    hold it for up to a tenth of a second.

    Raises:
        FinlabError: it is missing, does not load here, or was compiled from other C files.
    """
    return _loaded(ctypes.PyDLL)


@cache
def unlocked_library() -> ctypes.CDLL:
    """Returns the same library, whose functions release the interpreter's lock while they run: for
    calls so long that other threads should go on. To release it and take it again costs a
    microsecond, and more where other threads want it.

    Raises:
        FinlabError: as `library`.
    """
    return _loaded(ctypes.CDLL)


def _loaded(kind: type[_Library]) -> _Library:
    """Loads the library, with the types of its functions."""
    try:
        core = kind(str(PATH))
    except OSError as error:
        problem = f"cannot be loaded ({error})" if PATH.exists() else "is missing"
    else:
        version = core.fl_version() if hasattr(core, "fl_version") else 0
        if version == VERSION:
            for name, kinds in SIGNATURES.items():
                function = getattr(core, name)
                function.argtypes = [_TYPES[letter] for letter in kinds[1:]]
                function.restype = _TYPES[kinds[0]]
            return core
        problem = f"has version {version}, and this finlab needs {VERSION}"
    raise FinlabError(
        f"the compiled core {PATH} {problem}; run `make setup` or `pip install .` in a source "
        "tree, elsewhere install finlab again"
    )
