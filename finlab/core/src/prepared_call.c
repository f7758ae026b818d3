/* Single questions as a function of Python: who asks the same robot one wrench after the other
   calls C as he calls `len`, without ctypes.

   The library does not link to Python, and needs none of its headers: the few functions of its C
   API that stand here come as addresses (fl_use_python), which ctypes knows. All are exported by
   Python from 3.10 on, with the types of its stable ABI; so one library serves all of its versions,
   and is compiled wherever the core is.

   The function is called with the interpreter's lock, and holds it. */
#include "internal.h"
#include <stddef.h>

/* An object of Python, a `PyObject`. A function that returns one gives it away, with a count of its
   own; but PyList_GetItem and PyTuple_GetItem lend it. */
typedef struct python_object python_object;

/* What an object says of its memory, a `Py_buffer`. */
typedef struct {
  void *numbers;
  python_object *owner;
  ptrdiff_t length;
  ptrdiff_t item_size;
  int is_read_only;
  int dimensions;
  char *format;
  ptrdiff_t *shape;
  ptrdiff_t *strides;
  ptrdiff_t *suboffsets;
  void *internal;
} python_buffer;

enum {
  WITH_FORMAT_AND_STRIDES = 0x1c, /* PyBUF_FORMAT | PyBUF_STRIDES */
  MANY_ARGUMENTS = 0x80,          /* METH_FASTCALL */
  ROW_ITEMS = 5                   /* of an `AnswerRow` in finlab/core/calls.py */
};

/* Functions of Python's C API: what they return, their names, their arguments. */
#define PYTHON_FUNCTIONS(F)                                              \
  F(void, Py_IncRef, (python_object *))                                  \
  F(void, Py_DecRef, (python_object *))                                  \
  F(python_object *, PyObject_Type, (python_object *))                   \
  F(int, PyObject_GetBuffer, (python_object *, python_buffer *, int))    \
  F(void, PyBuffer_Release, (python_buffer *))                           \
  F(python_object *, PyObject_CallNoArgs, (python_object *))             \
  F(python_object *, PySequence_GetItem, (python_object *, ptrdiff_t))   \
  F(python_object *, PyList_GetItem, (python_object *, ptrdiff_t))       \
  F(ptrdiff_t, PyList_Size, (python_object *))                           \
  F(python_object *, PyTuple_GetItem, (python_object *, ptrdiff_t))      \
  F(ptrdiff_t, PyTuple_Size, (python_object *))                          \
  F(int, PyTuple_SetItem, (python_object *, ptrdiff_t, python_object *)) \
  F(python_object *, PyType_GenericAlloc, (python_object *, ptrdiff_t))  \
  F(double, PyFloat_AsDouble, (python_object *))                         \
  F(python_object *, PyLong_FromLong, (long))                            \
  F(void *, PyLong_AsVoidPtr, (python_object *))                         \
  F(python_object *, PyErr_Occurred, (void))                             \
  F(void, PyErr_Clear, (void))

#define FUNCTION(type, name, arguments) type(*name) arguments;
static struct {
  PYTHON_FUNCTIONS(FUNCTION)
} python;
#undef FUNCTION

/* Objects of Python that are compared with others by their addresses, in the order in which
   fl_use_python takes them. */
static struct {
  python_object *none;
  python_object *true_object;
  python_object *false_object;
  python_object *float_type;
  python_object *int_type;
  python_object *list_type;
  python_object *tuple_type;
  python_object *array_type; /* numpy's */
} known;

const char *fl_python_names(void) {
#define NAME(type, name, arguments) #name " "
  return PYTHON_FUNCTIONS(NAME);
#undef NAME
}

void fl_use_python(const void *functions, const void *objects) {
  memcpy(&python, functions, sizeof python);
  memcpy(&known, objects, sizeof known);
}

static python_object *counted(python_object *object) {
  python.Py_IncRef(object);
  return object;
}

/* The type of an object, to be compared alone. */
static python_object *type_of(python_object *object) {
  python_object *type = python.PyObject_Type(object);
  python.Py_DecRef(type); /* the object has another count of it */
  return type;
}

/* Reads a list or a tuple of plain numbers; returns whether it is one. */
static int read_sequence(python_object *sequence, int count, real *numbers) {
  const int is_list = type_of(sequence) == known.list_type;
  ptrdiff_t length;
  if (is_list) {
    length = python.PyList_Size(sequence);
  } else {
    length = python.PyTuple_Size(sequence);
  }
  if (length != count) return 0;
  for (int k = 0; k < count; k++) {
    python_object *item;
    if (is_list) {
      item = python.PyList_GetItem(sequence, k);
    } else {
      item = python.PyTuple_GetItem(sequence, k);
    }
    const python_object *type = type_of(item);
    if (type != known.float_type && type != known.int_type) return 0;
    numbers[k] = (real)python.PyFloat_AsDouble(item);
    if (numbers[k] == -1 && python.PyErr_Occurred()) { /* too large an integer */
      python.PyErr_Clear();
      return 0;
    }
  }
  return 1;
}

/* Reads an array of double precision of a shape; returns whether it is one. */
static int read_array(python_object *array, int rows, int columns, int dimensions, real *numbers) {
  python_buffer buffer;
  if (python.PyObject_GetBuffer(array, &buffer, WITH_FORMAT_AND_STRIDES) != 0) {
    python.PyErr_Clear();
    return 0;
  }
  int is_such = buffer.dimensions == dimensions && buffer.format[0] == 'd' && !buffer.format[1];
  is_such = is_such && buffer.shape[dimensions - 1] == columns;
  if (dimensions == 2) is_such = is_such && buffer.shape[0] == rows;
  for (int row = 0; is_such && row < rows; row++) {
    const char *at = buffer.numbers;
    if (dimensions == 2) at += row * buffer.strides[0];
    for (int column = 0; column < columns; column++) {
      double number;
      memcpy(&number, at + column * buffer.strides[dimensions - 1], sizeof number);
      numbers[row * columns + column] = (real)number;
    }
  }
  python.PyBuffer_Release(&buffer);
  return is_such;
}

/* Reads a wrench; returns whether it is six numbers that a robot may be asked for. */
static int read_wrench(const fl_prepared_call *call, python_object *object, real *wrench) {
  const python_object *type = type_of(object);
  int is_read = 0;
  if (type == known.array_type) {
    is_read = read_array(object, 1, 6, 1, wrench);
  } else if (type == known.list_type || type == known.tuple_type) {
    is_read = read_sequence(object, 6, wrench);
  }
  return is_read && SQRT(dot(wrench, wrench, 6)) <= call->most_wrench; /* not NaN */
}

/* Items of the list that a function is bound to. */
enum { CALL_ADDRESS, ROW_TYPE, MEMORY, COMMANDS, RENEW };

/* Has Python allocate rows where all are used; returns whether there is one now. */
static int find_row(python_object *bound, const fl_prepared_call *call) {
  while (call->used == call->row_count) { /* another thread may use what it allocates */
    python_object *nothing = python.PyObject_CallNoArgs(python.PyList_GetItem(bound, RENEW));
    if (!nothing) return 0;
    python.Py_DecRef(nothing);
  }
  return 1;
}

/* Asks what is prepared about a wrench, in a row; `previous` and `multipliers` are None for none.
   Returns what fl_answer_into_row does, of coupled robots fl_answer_coupled_into_row, or
   FL_BAD_ARGUMENT where an argument is of another type than is read here. */
static int ask(const fl_prepared_call *call, python_object *wrench, python_object *previous,
               python_object *multipliers, real *row) {
  const int n = COUNT(call->block);
  fl_question question = *call->question;
  real multipliers_begin[6];
  if (!read_wrench(call, wrench, question.wrench)) return FL_BAD_ARGUMENT;
  if (previous != known.none) {
    real *command = row + sizeof(fl_answer_row) / sizeof *row + 5 * (size_t)n;
    if (type_of(previous) != known.array_type) return FL_BAD_ARGUMENT;
    if (!read_array(previous, n, 3, 2, command)) return FL_BAD_ARGUMENT;
    question.previous = command;
    question.calm = call->calm;
  }
  if (multipliers != known.none) {
    if (type_of(multipliers) != known.array_type) return FL_BAD_ARGUMENT;
    if (!read_array(multipliers, 1, 6, 1, multipliers_begin)) return FL_BAD_ARGUMENT;
    question.multipliers = multipliers_begin;
  }
  if (call->coupled) {
    return fl_answer_coupled_into_row(call->coupled, call->block_linear, call->work, &question,
                                      call->most_error, row);
  }
  return fl_answer_into_row(call->block, call->work, &question, call->most_error, row);
}

/* The tuple (memory, row, is_met, is_finished, command) of an answer in a row. */
static python_object *answer_of(python_object *bound, int row, int is_met) {
  python_object *memory = counted(python.PyList_GetItem(bound, MEMORY));
  python_object *command = python.PySequence_GetItem(python.PyList_GetItem(bound, COMMANDS), row);
  python_object *index = python.PyLong_FromLong(row);
  python_object *answer = 0;
  if (command && index) {
    answer = python.PyType_GenericAlloc(python.PyList_GetItem(bound, ROW_TYPE), ROW_ITEMS);
  }
  if (!answer) {
    python.Py_DecRef(memory);
    if (command) python.Py_DecRef(command);
    if (index) python.Py_DecRef(index);
    return 0;
  }
  python_object *met = known.false_object;
  if (is_met) met = known.true_object;
  python.PyTuple_SetItem(answer, 0, memory);
  python.PyTuple_SetItem(answer, 1, index);
  python.PyTuple_SetItem(answer, 2, counted(met));
  python.PyTuple_SetItem(answer, 3, counted(known.true_object));
  python.PyTuple_SetItem(answer, 4, command);
  return answer;
}

/* The function of Python: answer(wrench, previous, multipliers). */
static python_object *answer(python_object *bound, python_object *const *arguments,
                             ptrdiff_t count) {
  if (count != 3) return counted(known.none);
  fl_prepared_call *call = python.PyLong_AsVoidPtr(python.PyList_GetItem(bound, CALL_ADDRESS));
  if (!find_row(bound, call)) return 0;
  if (*call->is_busy) return counted(known.none);
  const int row = call->used;
  real *numbers = call->rows + (size_t)row * (size_t)call->row_numbers;
  const int code = ask(call, arguments[0], arguments[1], arguments[2], numbers);
  if (code != FL_OK && code != FL_BEYOND_REACH) return counted(known.none);
  call->used = row + 1;
  return answer_of(bound, row, code == FL_OK);
}

/* A `PyMethodDef`. */
typedef struct {
  const char *name;
  python_object *(*function)(python_object *, python_object *const *, ptrdiff_t);
  int flags;
  const char *words;
} python_method;

const void *fl_python_method(void) {
  static const python_method method = {
      "answer", answer, MANY_ARGUMENTS,
      "answer(wrench, previous, multipliers)\n--\n\n"
      "Answers one wrench as it is prepared; None where it is left to `Core.answer_row`."};
  return &method;
}
