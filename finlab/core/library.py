import ctypes, os
from functools import cache
@cache
def library():
    lib = ctypes.PyDLL(os.path.join(os.path.dirname(__file__), "libfinlab.so"))
    pointer, whole = ctypes.c_void_p, ctypes.c_int
    lib.fl_sizes.argtypes = [whole]
    lib.fl_check.argtypes = [pointer, whole]
    lib.fl_prepare.argtypes = [pointer, pointer]
    lib.fl_answer_one.argtypes = [pointer] * 7
    lib.fl_answer_many.argtypes = [pointer] * 3 + [whole] + [pointer] * 6
    lib.fl_first.argtypes = [pointer] * 4
    lib.fl_look.argtypes = [pointer] * 5
    lib.fl_look.restype = ctypes.c_double
    lib.fl_worth.argtypes = lib.fl_support.argtypes = [pointer, pointer, pointer, whole, pointer]
    return lib
