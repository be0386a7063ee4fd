/* What the files of the compiled core share: how a tracked number is laid out, what `complete` is told, and what one
   file asks of another.

   The core is the same as the Python beside it, and faster (PEP 399). What is not frequent is handed to the Python,
   which `complete` names; so is all that could go wrong. docs/design.md says more.

   All is done under the GIL. While Python code may run, what is looked at is held by references of its own: a record
   may be replaced by another thread meanwhile. */

#ifndef ROSSLT_CORE_H
#define ROSSLT_CORE_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <limits.h>
#include <math.h>
#include <stddef.h>
#if PY_VERSION_HEX >= 0x030C0000
#error "ints are laid out differently from Python 3.12 on"
#endif
#if PY_VERSION_HEX < 0x030B0000
#include <longintrepr.h>
#endif
#if PY_VERSION_HEX < 0x030A0000
static inline PyObject *Py_NewRef(PyObject *x)
{
    Py_INCREF(x);
    return x;
}
#endif

/* Nothing but PyInit__core is seen from outside. */
#pragma GCC visibility push(hidden)

/* --- what a form is ------------------------------------------------------------------------------------------ */

enum { ADD, SUBTRACT, MULTIPLY, DIVIDE, FLOOR_DIVIDE, REMAINDER, POWER, OPERATORS };
enum { LEFT, RIGHT, BOTH };

/* Found out once: the forms of the operators above have numbers of their own, from OPERATOR on. */
enum { OTHER, ANY_SINGLE, ANY_BOTH, OPERATOR };
#define KIND(operator, side) (OPERATOR + 3 * (operator) + (side))
#define OPERATOR_OF(kind) (((kind) - OPERATOR) / 3)
#define SIDE_OF(kind) (((kind) - OPERATOR) % 3)
#define IS_SINGLE(kind) ((kind) == ANY_SINGLE || ((kind) >= OPERATOR && SIDE_OF(kind) != BOTH))

/* --- what `complete` is told (module.c) ---------------------------------------------------------------------- */

extern PyObject *forms[3 * OPERATORS], *fallbacks[OPERATORS], *negation, *source_form, *lazy_form, *shorten, *resolve,
    *new_other, *source_classes, *tracked_classes, *affine_form, *slopes_or_zeros, *absolute_form, *affine_of_python,
    *refill, *sine_form, *cosine_form;
extern int limit, max_shared_size;

/* Names of attributes and arguments. */
enum { FORWARD, INVERSE, SINGLE_OPERAND, OPERATION, OPERANDS, RECORD, AFFINE, VALUE, NAME, KEY, GETTER, TRACKED,
       NAMES };
extern PyObject *names[NAMES];

/* --- tracked numbers (numbers.c) ----------------------------------------------------------------------------- */

typedef struct {
    PyObject *form, *first, *second; /* the record; none of them is NULL */
    PyObject *fold;                  /* NULL until it is made */
    int size;
    unsigned char kind;
    unsigned char collected; /* whether the garbage collector knows the value: it may be part of a cycle */
} Record;

typedef struct {
    PyFloatObject value;
    Record record;
    PyObject *plain; /* what it was made of, or gave when it was asked: always the same object; NULL until then */
} Float;

/* Behind the digits of an int, whose number differs. */
typedef struct {
    Record record;
    PyObject *plain;
} IntPart;

extern PyTypeObject *FloatType, *IntType;

/* Whether a value is one of the tracked values of the core. */
#define IS_FLOAT(x) (Py_TYPE(x) == FloatType)
#define IS_INT(x) (Py_TYPE(x) == IntType)
#define IS_OURS(x) (IS_FLOAT(x) || IS_INT(x))

static inline Py_ssize_t digits_of(PyObject *whole)
{
    return Py_SIZE(whole) < 0 ? -Py_SIZE(whole) : Py_SIZE(whole);
}

static inline IntPart *int_part(PyObject *self)
{
    size_t end = offsetof(PyLongObject, ob_digit) + (size_t)digits_of(self) * sizeof(digit);
    size_t alignment = sizeof(void *);
    return (IntPart *)((char *)self + (end + alignment - 1) / alignment * alignment);
}

static inline Record *record_of(PyObject *self)
{
    return IS_FLOAT(self) ? &((Float *)self)->record : &int_part(self)->record;
}

static inline int is_record(PyObject *x)
{
    return PyTuple_CheckExact(x) && PyTuple_GET_SIZE(x) == 3;
}

/* The plain value of a tracked one, a plain float or int as it is, NULL without an error for anything else. */
PyObject *plain_of(PyObject *x);

/* Whether an attribute is true; -1 with an error. */
int truth_of(PyObject *thing, int name);

/* The kind of a form; -1 with an error. */
int kind_of(PyObject *form);

/* What an operation gives, a float or an int, of a tracked operand and a constant or another one: plain where no more may
   be recorded. */
PyObject *new_number(PyObject *value, PyObject *form, PyObject *first, PyObject *second, int kind);

/* A tracked value's record (a new reference), made first where it is lazy, and its kind; NULL with an error. */
PyObject *resolved(PyObject *value, int *kind);

/* As `joint_size` in affine.py. */
static inline int joint_size(int first, int second)
{
    int small = first < second ? first : second, large = first < second ? second : first;
    return large + (small < max_shared_size ? small : max_shared_size) + 1;
}

PyObject *new_value(PyObject *module, PyObject *const *args, Py_ssize_t count);
PyObject *lazy_of(PyObject *module, PyObject *const *args, Py_ssize_t count);

/* Make the classes, and put them in the module: -1 with an error. */
int add_classes(PyObject *module);

/* --- the allowance (allowance.c) -------------------------------------------------------------------------------- */

extern long long allowance; /* how many operations may still be recorded; none where it is 0 */

/* Whether a used up allowance was refilled: -1 with an error. */
int refilled(long long overdrawn);

/* Whether an operation may be recorded: -1 with an error. */
static inline int may_record(void)
{
    if (allowance <= 1) return refilled(0);
    allowance--;
    return 1;
}

PyObject *allow(PyObject *module, PyObject *count);
PyObject *spend(PyObject *module, PyObject *count);

/* --- places that hold values (slots.c) ----------------------------------------------------------------------- */

PyObject *exchange(PyObject *module, PyObject *rows);

/* --- arithmetic on doubles ----------------------------------------------------------------------------------- */

/* What an operator makes of two plain floats; 0 where Python has to do it. */
static inline int compute_floats(int operator, double a, double b, double *result)
{
    switch (operator) {
    case ADD:
        *result = a + b;
        return 1;
    case SUBTRACT:
        *result = a - b;
        return 1;
    case MULTIPLY:
        *result = a * b;
        return 1;
    case DIVIDE:
        if (b == 0.0) return 0;
        *result = a / b;
        return 1;
    default:
        return 0;
    }
}

/* A plain float or int as a double; 0 where it is something else, or too large. */
static inline int as_double(PyObject *x, double *number)
{
    if (PyFloat_CheckExact(x)) {
        *number = PyFloat_AS_DOUBLE(x);
        return 1;
    }
    if (!PyLong_CheckExact(x)) return 0;
    *number = PyLong_AsDouble(x);
    if (*number == -1.0 && PyErr_Occurred()) {
        PyErr_Clear();
        return 0;
    }
    return 1;
}

/* --- slopes ---------------------------------------------------------------------------------------------------- */

/* A slope, and whether it is an int in Python. */
typedef struct {
    double value;
    int is_whole;
} Slope;

#define MOST_EXACT 9007199254740991.0 /* a whole number that is rounded to at most this was not rounded */

/* A number as a slope; 0 where it is none of which this knows all digits. */
static inline int as_slope(PyObject *x, Slope *slope)
{
    slope->is_whole = PyLong_CheckExact(x);
    return as_double(x, &slope->value) && (!slope->is_whole || fabs(slope->value) <= MOST_EXACT);
}

/* --- sources --------------------------------------------------------------------------------------------------- */

#define UNKNOWN_SOURCE 2

/* Whether two sources are the same place; UNKNOWN_SOURCE where Python alone knows, -1 with an error. No Python runs. */
static inline int is_same_source(PyObject *one, PyObject *other)
{
    if (one == other) return 1;
    PyObject *named = PyTuple_GET_ITEM(source_classes, 0);
    if ((PyObject *)Py_TYPE(one) != named || (PyObject *)Py_TYPE(other) != named) return UNKNOWN_SOURCE;
    return PyObject_RichCompareBool(one, other, Py_EQ); /* a text and an int each */
}

/* --- the terms of an affine value (terms.c) -------------------------------------------------------------------- */

enum { TERMS_FAILED = -1, NO_TERMS, TERMS_FOUND, TERMS_OF_PYTHON };
enum { MOST_NODES = 64, MOST_TERMS = 32 };

typedef struct {
    PyObject *leaf; /* a source's value; nothing here holds it */
    Slope slope;
} Term;

typedef struct {
    PyObject *node;
    Slope rise;
} Branch;

typedef struct {
    Term terms[MOST_TERMS];
    Branch others[MOST_NODES]; /* to be walked yet */
    int term_count, other_count;
} Terms;

/* The terms of a value, by its operations from the first one on, left before right. */
int find_terms(Terms *terms, PyObject *node);

/* --- the functions of the other files, as module.c documents them --------------------------------------------- */

PyObject *along_chain(PyObject *module, PyObject *const *args, Py_ssize_t count); /* chains.c */
PyObject *solve_chain(PyObject *module, PyObject *const *args, Py_ssize_t count);
PyObject *add_nodes(PyObject *module, PyObject *args); /* nodes.c */
PyObject *swept(PyObject *module, PyObject *values);   /* folds.c */
PyObject *resized(PyObject *module, PyObject *args);
PyObject *make_tape(PyObject *module, PyObject *args);     /* tapes.c */
PyObject *run_tape(PyObject *module, PyObject *args);
PyObject *tape_slopes(PyObject *module, PyObject *args);
PyObject *shortest_step(PyObject *module, PyObject *args); /* steps.c */
PyObject *affine_terms(PyObject *module, PyObject *value); /* terms.c */
PyObject *make_recorder(PyObject *module, PyObject *args); /* functions.c */
PyObject *make_keeper(PyObject *module, PyObject *args);
PyObject *make_reflector(PyObject *module, PyObject *args);
PyObject *make_stripper(PyObject *module, PyObject *args);

#pragma GCC visibility pop

#endif
