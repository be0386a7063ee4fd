/* The compiled core of the room `values` (PEP 399): the same as the Python beside it, and faster.

   Tracked floats and ints, the arithmetic that records (`operators.py`), and two walks along a chain of operations on
   one source (`_along_chain` of `graph.py`, `solve/chain.py`), two along any expression (`Graph._add`, `_swept` of
   `affine.py`) and one along two of them (`is_made_alike` of `tracked.py`). What is not frequent is handed to the Python, which `complete` names; so is
   all that could go wrong. docs/design.md says more.

   All is done under the GIL. While Python code may run, what is looked at is held by references of its own: a record
   may be replaced by another thread meanwhile. */

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <stddef.h>
#if PY_VERSION_HEX >= 0x030C0000
#error "ints are laid out differently from Python 3.12 on"
#endif
#if PY_VERSION_HEX < 0x030B0000
#include <longintrepr.h>
#endif

#define INTERFACE 5 /* what `accelerator.py` asks for */

enum { ADD, SUBTRACT, MULTIPLY, DIVIDE, FLOOR_DIVIDE, REMAINDER, OPERATORS };
enum { LEFT, RIGHT, BOTH };

/* What a form is, found out once: the forms of the operators above have numbers of their own, from OPERATOR on. */
enum { OTHER, ANY_SINGLE, ANY_BOTH, OPERATOR };
#define KIND(operator, side) (OPERATOR + 3 * (operator) + (side))
#define OPERATOR_OF(kind) (((kind) - OPERATOR) / 3)
#define SIDE_OF(kind) (((kind) - OPERATOR) % 3)
#define IS_SINGLE(kind) ((kind) == ANY_SINGLE || ((kind) >= OPERATOR && SIDE_OF(kind) != BOTH))

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

static PyTypeObject *FloatType, *IntType;

/* What `complete` is told. */
static PyObject *forms[3 * OPERATORS], *fallbacks[OPERATORS], *negation, *source_form, *lazy_form, *shorten, *resolve,
    *new_other, *source_classes, *tracked_classes, *affine_form, *slopes_or_zeros;
static int limit, max_shared_size;
static PyObject *str_forward, *str_inverse, *str_single_operand, *str_operation, *str_operands, *str_record, *str_affine,
    *str_value, *str_name, *str_key, *str_getter, *str_tracked;

static IntPart *int_part(PyObject *self)
{
    Py_ssize_t size = Py_SIZE(self) < 0 ? -Py_SIZE(self) : Py_SIZE(self);
    size_t digits = offsetof(PyLongObject, ob_digit) + (size_t)size * sizeof(digit);
    size_t alignment = sizeof(void *);
    return (IntPart *)((char *)self + (digits + alignment - 1) / alignment * alignment);
}

/* Whether a value is one of the tracked values of this file. */
#define IS_FLOAT(x) (Py_TYPE(x) == FloatType)
#define IS_INT(x) (Py_TYPE(x) == IntType)
#define IS_OURS(x) (IS_FLOAT(x) || IS_INT(x))

static inline Record *record_of(PyObject *self)
{
    return IS_FLOAT(self) ? &((Float *)self)->record : &int_part(self)->record;
}

/* The plain value of a tracked one, a plain float or int as it is, NULL without an error for anything else. */
static PyObject *plain_of(PyObject *x)
{
    if (IS_FLOAT(x)) {
        Float *self = (Float *)x;
        if (self->plain == NULL) self->plain = PyFloat_FromDouble(self->value.ob_fval);
        Py_XINCREF(self->plain);
        return self->plain;
    }
    PyObject *plain = IS_INT(x) ? int_part(x)->plain : PyFloat_CheckExact(x) || PyLong_CheckExact(x) ? x : NULL;
    Py_XINCREF(plain);
    return plain;
}

static int truth_of(PyObject *thing, PyObject *name)
{
    PyObject *found = PyObject_GetAttr(thing, name);
    int truth = found == NULL ? -1 : PyObject_IsTrue(found);
    Py_XDECREF(found);
    return truth;
}

/* The kind of a form; -1 with an error. */
static int kind_of(PyObject *form)
{
    if (form == source_form || form == lazy_form) return OTHER;
    for (int number = 0; number < 3 * OPERATORS; number++) if (form == forms[number]) return OPERATOR + number;
    int truth = truth_of(form, str_single_operand);
    if (truth != 0) return truth < 0 ? -1 : ANY_SINGLE;
    PyObject *operation = PyObject_GetAttr(form, str_operation);
    int kind = operation == NULL ? -1 : operation == Py_None ? OTHER : ANY_BOTH;
    Py_XDECREF(operation);
    return kind;
}

/* Whether something that a record refers to may lead back to it. Sources hold texts and numbers only. */
static int may_cycle(PyObject *x)
{
    if (x == Py_None || PyFloat_CheckExact(x) || PyLong_CheckExact(x) || PyUnicode_CheckExact(x) || PyBool_Check(x)) {
        return 0;
    }
    if (IS_OURS(x)) return record_of(x)->collected;
    for (Py_ssize_t at = 0; at < PyTuple_GET_SIZE(source_classes); at++) {
        if ((PyObject *)Py_TYPE(x) == PyTuple_GET_ITEM(source_classes, at)) return 0;
    }
    return 1;
}

static void collect(PyObject *self, Record *record)
{
    if (!record->collected) {
        record->collected = 1;
        PyObject_GC_Track(self);
    }
}

static void fill(Record *record, PyObject *form, PyObject *first, PyObject *second, int kind, Py_ssize_t size)
{
    Py_INCREF(form);
    Py_INCREF(first);
    Py_INCREF(second);
    record->form = form;
    record->first = first;
    record->second = second;
    record->fold = NULL;
    record->size = (int)size;
    record->kind = (unsigned char)kind;
    record->collected = 0;
}

static PyObject *new_float(double value, PyObject *form, PyObject *first, PyObject *second, int kind, Py_ssize_t size)
{
    Float *self = PyObject_GC_New(Float, FloatType);
    if (self != NULL) {
        self->value.ob_fval = value;
        self->plain = NULL;
        fill(&self->record, form, first, second, kind, size);
    }
    return (PyObject *)self;
}

static PyObject *new_int(PyObject *plain, PyObject *form, PyObject *first, PyObject *second, int kind, Py_ssize_t size)
{
    Py_ssize_t digits = Py_SIZE(plain) < 0 ? -Py_SIZE(plain) : Py_SIZE(plain);
    PyLongObject *self = PyObject_GC_NewVar(PyLongObject, IntType, digits);
    if (self != NULL) {
        ((PyVarObject *)self)->ob_size = Py_SIZE(plain);
        memcpy(self->ob_digit, ((PyLongObject *)plain)->ob_digit, (size_t)digits * sizeof(digit));
        IntPart *part = int_part((PyObject *)self);
        fill(&part->record, form, first, second, kind, size);
        Py_INCREF(plain);
        part->plain = plain;
    }
    return (PyObject *)self;
}

/* --- the types ----------------------------------------------------------------------------------------------- */

static int traverse(PyObject *self, visitproc visit, void *arg)
{
    Record *record = record_of(self);
#if PY_VERSION_HEX >= 0x03090000
    Py_VISIT(Py_TYPE(self));
#endif
    Py_VISIT(record->form);
    Py_VISIT(record->first);
    Py_VISIT(record->second);
    Py_VISIT(record->fold);
    return 0;
}

static void set_record(Record *record, PyObject *form, PyObject *first, PyObject *second, int kind)
{
    PyObject *old[] = {record->form, record->first, record->second};
    Py_INCREF(form);
    Py_INCREF(first);
    Py_INCREF(second);
    record->form = form;
    record->first = first;
    record->second = second;
    record->kind = (unsigned char)kind;
    for (int at = 0; at < 3; at++) Py_DECREF(old[at]);
}

static int clear(PyObject *self)
{
    Record *record = record_of(self);
    set_record(record, Py_None, Py_None, Py_None, OTHER);
    Py_CLEAR(record->fold);
    return 0;
}

static void dealloc(PyObject *self)
{
    Record *record = record_of(self);
    PyTypeObject *type = Py_TYPE(self);
    if (record->collected) PyObject_GC_UnTrack(self);
    Py_TRASHCAN_BEGIN(self, dealloc)
    Py_DECREF(record->form);
    Py_DECREF(record->first);
    Py_DECREF(record->second);
    Py_XDECREF(record->fold);
    Py_XDECREF(IS_INT(self) ? int_part(self)->plain : ((Float *)self)->plain);
    PyObject_GC_Del(self);
    Py_DECREF(type);
    Py_TRASHCAN_END
}

/* Calling a tracked class gives a plain value, as others make numbers with `type(x)(...)`. */
static PyObject *plain_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    PyTypeObject *kind = PyType_IsSubtype(type, FloatType) ? &PyFloat_Type : &PyLong_Type;
    return PyObject_Call((PyObject *)kind, args, kwargs);
}

static PyObject *get_plain(PyObject *self, void *unused)
{
    return plain_of(self);
}

static PyObject *get_record(PyObject *self, void *unused)
{
    Record *record = record_of(self);
    return PyTuple_Pack(3, record->form, record->first, record->second);
}

static int put_record(PyObject *self, PyObject *value, void *unused)
{
    if (value == NULL || !PyTuple_CheckExact(value) || PyTuple_GET_SIZE(value) != 3) {
        PyErr_SetString(PyExc_TypeError, "a record is a tuple (form, first, second)");
        return -1;
    }
    int kind = kind_of(PyTuple_GET_ITEM(value, 0));
    if (kind < 0) return -1;
    Record *record = record_of(self);
    set_record(record, PyTuple_GET_ITEM(value, 0), PyTuple_GET_ITEM(value, 1), PyTuple_GET_ITEM(value, 2), kind);
    collect(self, record);
    return 0;
}

static PyObject *get_fold(PyObject *self, void *unused)
{
    PyObject *fold = record_of(self)->fold;
    if (fold == NULL) fold = Py_None; /* an AttributeError, as of the Python, takes longer than what asks for it */
    Py_INCREF(fold);
    return fold;
}

static int put_fold(PyObject *self, PyObject *value, void *unused)
{
    Record *record = record_of(self);
    PyObject *old = record->fold;
    Py_XINCREF(value);
    record->fold = value;
    collect(self, record);
    Py_XDECREF(old);
    return 0;
}

static PyObject *get_size(PyObject *self, void *unused)
{
    return PyLong_FromLong(record_of(self)->size);
}

static int put_size(PyObject *self, PyObject *value, void *unused)
{
    if (value == NULL) PyErr_SetString(PyExc_TypeError, "a value has a size");
    long size = value == NULL ? -1 : PyLong_AsLong(value);
    if (size == -1 && PyErr_Occurred()) return -1;
    record_of(self)->size = (int)size;
    return 0;
}

static PyGetSetDef attributes[] = {
    {"_plain", get_plain, NULL, "The plain value.", NULL},
    {"_record", get_record, put_record, "The record (form, first, second).", NULL},
    {"_fold", get_fold, put_fold, "The record that stands for it near its present value, once it is made.", NULL},
    {"_size", get_size, put_size, "How large the expression is.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};

/* --- arithmetic ---------------------------------------------------------------------------------------------- */

/* As `joint_size` in recording.py. */
static Py_ssize_t joint_size(Py_ssize_t first, Py_ssize_t second)
{
    Py_ssize_t small = first < second ? first : second, large = first < second ? second : first;
    if (small >= 0) return large + (small < max_shared_size ? small : max_shared_size) + 1;
    return (large < 0 ? large : small + (large < max_shared_size ? large : max_shared_size)) + 1;
}

/* A new value, which knows the collector if one of its operands does, and stays in the limit. */
static PyObject *finished(PyObject *result, int collected)
{
    if (result == NULL) return NULL;
    Record *record = record_of(result);
    if (collected) collect(result, record);
    if (record->size > limit) {
        PyObject *done = PyObject_CallFunctionObjArgs(shorten, result, NULL);
        if (done == NULL) {
            Py_DECREF(result);
            return NULL;
        }
        Py_DECREF(done);
    }
    return result;
}

static const binaryfunc compute[] = {PyNumber_Add,        PyNumber_Subtract,    PyNumber_Multiply,
                                     PyNumber_TrueDivide, PyNumber_FloorDivide, PyNumber_Remainder};

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

/* The result of an operator: an int, or a float where that is NULL. One operand at least is tracked. */
static inline PyObject *result_of(int operator, PyObject *v, PyObject *w, PyObject *whole, double value)
{
    int side = IS_OURS(v) ? IS_OURS(w) ? BOTH : LEFT : RIGHT;
    PyObject *first = side == RIGHT ? w : v, *second = side == RIGHT ? v : w;
    if (operator == MULTIPLY && side == RIGHT && IS_INT(w)) side = LEFT; /* as `product` in operators.py */
    Record *record = record_of(first);
    Py_ssize_t size = record->size + 1;
    int collected = record->collected, kind = KIND(operator, side);
    if (side == BOTH) {
        size = joint_size(record->size, record_of(second)->size);
        collected = collected || record_of(second)->collected;
    }
    PyObject *form = forms[kind - OPERATOR];
    if (whole != NULL) return finished(new_int(whole, form, first, second, kind, size), collected);
    return finished(new_float(value, form, first, second, kind, size), collected);
}

/* What an operator gives that has something else than floats to do. */
static PyObject *recorded(int operator, PyObject *v, PyObject *w)
{
    PyObject *a = plain_of(v), *b = plain_of(w), *value = NULL, *result = NULL;
    if (a != NULL && b != NULL) {
        value = compute[operator](a, b);
    } else if (!PyErr_Occurred()) {
        result = PyObject_CallFunctionObjArgs(fallbacks[operator], v, w, NULL);
    }
    Py_XDECREF(a);
    Py_XDECREF(b);
    if (value == NULL) return result;
    int is_float = PyFloat_CheckExact(value);
    result = result_of(operator, v, w, is_float ? NULL : value, is_float ? PyFloat_AS_DOUBLE(value) : 0.0);
    Py_DECREF(value);
    return result;
}

#define HOLDS_FLOAT(x) (IS_FLOAT(x) || PyFloat_CheckExact(x))

static inline PyObject *operate(int operator, PyObject *v, PyObject *w)
{
    double value;
    if (HOLDS_FLOAT(v) && HOLDS_FLOAT(w) &&
        compute_floats(operator, PyFloat_AS_DOUBLE(v), PyFloat_AS_DOUBLE(w), &value)) {
        return result_of(operator, v, w, NULL, value);
    }
    return recorded(operator, v, w);
}

static PyObject *add(PyObject *v, PyObject *w) { return operate(ADD, v, w); }
static PyObject *subtract(PyObject *v, PyObject *w) { return operate(SUBTRACT, v, w); }
static PyObject *multiply(PyObject *v, PyObject *w) { return operate(MULTIPLY, v, w); }
static PyObject *divide(PyObject *v, PyObject *w) { return operate(DIVIDE, v, w); }
static PyObject *floor_divide(PyObject *v, PyObject *w) { return operate(FLOOR_DIVIDE, v, w); }
static PyObject *remainder_of(PyObject *v, PyObject *w) { return operate(REMAINDER, v, w); }

static PyObject *negate(PyObject *self)
{
    Record *record = record_of(self);
    PyObject *result;
    if (IS_FLOAT(self)) {
        double value = -PyFloat_AS_DOUBLE(self);
        result = new_float(value, negation, self, Py_None, ANY_SINGLE, record->size + 1);
    } else {
        PyObject *value = PyNumber_Negative(int_part(self)->plain);
        if (value == NULL) return NULL;
        result = new_int(value, negation, self, Py_None, ANY_SINGLE, record->size + 1);
        Py_DECREF(value);
    }
    return finished(result, record->collected);
}

/* --- functions ----------------------------------------------------------------------------------------------- */

static PyObject *new_value(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 3 || !PyTuple_CheckExact(args[1]) || PyTuple_GET_SIZE(args[1]) != 3) {
        PyErr_SetString(PyExc_TypeError, "new(value, (form, first, second), size)");
        return NULL;
    }
    PyObject *value = args[0], *result;
    PyObject *form = PyTuple_GET_ITEM(args[1], 0);
    PyObject *first = PyTuple_GET_ITEM(args[1], 1), *second = PyTuple_GET_ITEM(args[1], 2);
    long size = PyLong_AsLong(args[2]);
    int kind = size == -1 && PyErr_Occurred() ? -1 : kind_of(form);
    if (kind < 0) return NULL;
    if (PyFloat_CheckExact(value)) {
        result = new_float(PyFloat_AS_DOUBLE(value), form, first, second, kind, size);
        if (result != NULL) {
            Py_INCREF(value);
            ((Float *)result)->plain = value;
        }
    } else if (PyLong_CheckExact(value)) {
        result = new_int(value, form, first, second, kind, size);
    } else {
        return PyObject_CallFunctionObjArgs(new_other, value, args[1], args[2], NULL);
    }
    if (result != NULL && ((kind == OTHER && form != source_form) || may_cycle(first) || may_cycle(second))) {
        collect(result, record_of(result));
    }
    return result;
}

/* The values between a value and its one source, the source's last, in a list; NULL without an error where there is no
   such chain, or it is not all of this file. */
static PyObject *follow(PyObject *value)
{
    PyObject *chain = PyList_New(0);
    while (chain != NULL && IS_OURS(value)) {
        Record *record = record_of(value);
        if (PyList_Append(chain, value) < 0) break;
        if (record->form == source_form) return chain;
        if (!IS_SINGLE(record->kind)) break;
        value = record->first;
    }
    Py_XDECREF(chain);
    return NULL;
}

#define LAST(chain) PyList_GET_ITEM(chain, PyList_GET_SIZE(chain) - 1)

static PyObject *not_here(void)
{
    Py_INCREF(Py_NotImplemented);
    return Py_NotImplemented;
}

/* What a function of a record's form, forward or inverse, gives for one or two values and the record's constant. */
static PyObject *call(const Record *record, PyObject *name, PyObject *a, PyObject *b)
{
    PyObject *form = record->form, *second = record->second, *result = NULL;
    Py_INCREF(form);
    Py_INCREF(second);
    PyObject *function = PyObject_GetAttr(form, name);
    if (function != NULL) {
        result = PyObject_CallFunctionObjArgs(function, a, b ? b : second, b ? second : NULL, NULL);
        Py_DECREF(function);
    }
    Py_DECREF(form);
    Py_DECREF(second);
    return result;
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

/* What an operation makes of a float; 0 where Python has to do it. */
static inline int forwards(int kind, double value, PyObject *constant, double *result)
{
    double other;
    if (kind < OPERATOR || !as_double(constant, &other)) return 0;
    if (SIDE_OF(kind) == LEFT) return compute_floats(OPERATOR_OF(kind), value, other, result);
    return compute_floats(OPERATOR_OF(kind), other, value, result);
}

/* The float of which an operation makes the wanted one, by the inverses of the table; 0 where Python has to do it. */
static inline int backwards(int kind, double wanted, PyObject *constant, double *result)
{
    double other;
    if (kind < OPERATOR || !as_double(constant, &other)) return 0;
    int is_left = SIDE_OF(kind) == LEFT;
    switch (OPERATOR_OF(kind)) {
    case ADD:
        return compute_floats(SUBTRACT, wanted, other, result);
    case SUBTRACT:
        if (is_left) return compute_floats(ADD, wanted, other, result);
        return compute_floats(SUBTRACT, other, wanted, result);
    case MULTIPLY:
        return compute_floats(DIVIDE, wanted, other, result);
    case DIVIDE:
        if (is_left) return compute_floats(MULTIPLY, wanted, other, result);
        return compute_floats(DIVIDE, other, wanted, result);
    default:
        return 0;
    }
}

/* The value of a chain where its source has another one; NotImplemented where a record was replaced meanwhile. It takes
   over the reference to that. */
static PyObject *run(PyObject *chain, PyObject *value)
{
    Py_ssize_t at = PyList_GET_SIZE(chain) - 2;
    while (value != NULL && at >= 0) {
        Record *record = record_of(PyList_GET_ITEM(chain, at));
        double number = PyFloat_CheckExact(value) ? PyFloat_AS_DOUBLE(value) : 0.0;
        if (PyFloat_CheckExact(value) && forwards(record->kind, number, record->second, &number)) {
            /* as many as can be done without making a float of each */
            while (--at >= 0) {
                record = record_of(PyList_GET_ITEM(chain, at));
                if (!forwards(record->kind, number, record->second, &number)) break;
            }
            Py_SETREF(value, PyFloat_FromDouble(number));
        } else if (!IS_SINGLE(record->kind)) {
            Py_SETREF(value, not_here());
            break;
        } else {
            Py_SETREF(value, call(record, str_forward, value, NULL));
            at--;
        }
    }
    return value;
}

/* As `_along_chain` in graph.py; NotImplemented where that has to do it. */
static PyObject *along_chain(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 2) return PyErr_Format(PyExc_TypeError, "along_chain(value, changes)");
    PyObject *chain = PyDict_CheckExact(args[1]) ? follow(args[0]) : NULL, *value = NULL;
    if (chain != NULL) {
        PyObject *source = record_of(LAST(chain))->first;
        Py_INCREF(source);
        value = PyDict_GetItemWithError(args[1], source);
        Py_XINCREF(value);
        Py_DECREF(source);
    }
    if (value != NULL) {
        value = run(chain, value);
    } else if (!PyErr_Occurred()) {
        value = not_here();
    }
    Py_XDECREF(chain);
    return value;
}

/* None instead of an error that an operation or its inverse raises where there is no answer. */
static PyObject *none_for_error(void)
{
    if (!PyErr_ExceptionMatches(PyExc_ArithmeticError) && !PyErr_ExceptionMatches(PyExc_ValueError) &&
        !PyErr_ExceptionMatches(PyExc_TypeError)) {
        return NULL;
    }
    PyErr_Clear();
    Py_RETURN_NONE;
}

/* The answer of `solve_chain` for a chain between two floats. */
static PyObject *solved(PyObject *chain, double target, double relative)
{
    double wanted = target, present = PyFloat_AS_DOUBLE(PyList_GET_ITEM(chain, 0));
    PyObject *found, *leaf = LAST(chain);
    for (Py_ssize_t at = 0; at < PyList_GET_SIZE(chain) - 1; at++) {
        Record *record = record_of(PyList_GET_ITEM(chain, at));
        if (backwards(record->kind, wanted, record->second, &wanted)) continue;
        if (!IS_SINGLE(record->kind)) return not_here();
        PyObject *number = PyFloat_FromDouble(wanted), *operand = plain_of(record->first);
        found = number && operand ? call(record, str_inverse, number, operand) : NULL;
        Py_XDECREF(number);
        Py_XDECREF(operand);
        if (found == NULL) return none_for_error();
        int is_float = PyFloat_CheckExact(found);
        wanted = is_float ? PyFloat_AS_DOUBLE(found) : 0.0;
        Py_DECREF(found);
        if (!is_float) return not_here();
    }
    if (target == present) {
        wanted = PyFloat_AS_DOUBLE(leaf);
    } else {
        found = run(chain, PyFloat_FromDouble(wanted));
        if (found == NULL) return none_for_error();
        if (found == Py_NotImplemented) return found;
        int is_met = PyFloat_CheckExact(found) &&
                     fabs(PyFloat_AS_DOUBLE(found) - target) <= relative * fabs(target) && isfinite(wanted);
        Py_DECREF(found);
        if (!is_met) Py_RETURN_NONE;
    }
    PyObject *source = record_of(leaf)->first, *number = PyFloat_FromDouble(wanted), *answer = PyDict_New();
    Py_INCREF(source);
    if (number == NULL || answer == NULL || PyDict_SetItem(answer, source, number) < 0) Py_CLEAR(answer);
    Py_DECREF(source);
    Py_XDECREF(number);
    return answer;
}

/* As `solve_chain` in solve/chain.py; NotImplemented where that has to do it. */
static PyObject *solve_chain(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 3 || !PyFloat_CheckExact(args[2])) {
        return PyErr_Format(PyExc_TypeError, "solve_chain(value, target, relative)");
    }
    PyObject *chain = IS_FLOAT(args[0]) && PyFloat_CheckExact(args[1]) ? follow(args[0]) : NULL, *answer = NULL;
    if (chain != NULL && IS_FLOAT(LAST(chain))) {
        answer = solved(chain, PyFloat_AS_DOUBLE(args[1]), PyFloat_AS_DOUBLE(args[2]));
    } else if (!PyErr_Occurred()) {
        answer = not_here();
    }
    Py_XDECREF(chain);
    return answer;
}

/* --- any expression ------------------------------------------------------------------------------------------ */

/* A node's record as a tuple (a new reference) and its kind; NULL with an error. */
static PyObject *record_and_kind(PyObject *node, int *kind)
{
    if (IS_OURS(node)) {
        *kind = record_of(node)->kind;
        return get_record(node, NULL);
    }
    PyObject *record = PyObject_GetAttr(node, str_record);
    if (record != NULL && (!PyTuple_CheckExact(record) || PyTuple_GET_SIZE(record) != 3)) {
        PyErr_SetString(PyExc_TypeError, "a record is a tuple (form, first, second)");
        Py_CLEAR(record);
    }
    *kind = record == NULL ? -1 : kind_of(PyTuple_GET_ITEM(record, 0));
    if (*kind < 0) Py_CLEAR(record);
    return record;
}

static PyObject *key_of(PyObject *node)
{
    return PyLong_FromVoidPtr(node);
}

/* Put those of some operands on the stack, the first on top, that have no place yet: how many, -1 with an error. */
static int push_missing(PyObject *stack, PyObject *index, PyObject *operands)
{
    int pushed = 0;
    for (Py_ssize_t at = PySequence_Fast_GET_SIZE(operands) - 1; at >= 0; at--) {
        PyObject *operand = PySequence_Fast_GET_ITEM(operands, at), *key = key_of(operand);
        int is_there = key == NULL ? -1 : PyDict_Contains(index, key);
        Py_XDECREF(key);
        if (is_there < 0 || (!is_there && PyList_Append(stack, operand) < 0)) return -1;
        pushed += !is_there;
    }
    return pushed;
}

/* The operands of a record of this kind as a list or tuple; of a source none, and its place is kept. */
static PyObject *operands_of(PyObject *record, int kind, PyObject *nodes, PyObject *occurrences)
{
    PyObject *form = PyTuple_GET_ITEM(record, 0), *first = PyTuple_GET_ITEM(record, 1),
             *second = PyTuple_GET_ITEM(record, 2);
    if (IS_SINGLE(kind)) return PyTuple_Pack(1, first);
    if (kind != OTHER) return PyTuple_Pack(2, first, second);
    if (form != source_form) {
        PyObject *operands = PyObject_CallMethodObjArgs(form, str_operands, first, second, NULL), *listed = NULL;
        if (operands != NULL) {
            listed = PySequence_Fast(operands, "operands are a sequence");
            Py_DECREF(operands);
        }
        return listed;
    }
    PyObject *places = PyDict_GetItemWithError(occurrences, first), *place = NULL;
    int failed = places == NULL && PyErr_Occurred();
    Py_XINCREF(places);
    if (!failed && places == NULL) {
        places = PyList_New(0);
        failed = places == NULL || PyDict_SetItem(occurrences, first, places) < 0;
    }
    place = failed ? NULL : PyLong_FromSsize_t(PyList_GET_SIZE(nodes));
    failed = place == NULL || PyList_Append(places, place) < 0;
    Py_XDECREF(places);
    Py_XDECREF(place);
    return failed ? NULL : PyTuple_New(0);
}

/* Do what is on top of the stack: -1 with an error. */
static int visit_top(PyObject *stack, PyObject *nodes, PyObject *records, PyObject *index, PyObject *occurrences)
{
    Py_ssize_t top = PyList_GET_SIZE(stack) - 1;
    int kind, status = -1, pushed = 0;
    PyObject *node = PyList_GET_ITEM(stack, top), *record = NULL, *operands = NULL, *place = NULL;
    Py_INCREF(node);
    PyObject *key = key_of(node);
    int is_there = key == NULL ? -1 : PyDict_Contains(index, key);
    if (is_there < 0) goto done;
    if (!is_there) {
        record = record_and_kind(node, &kind);
        if (record != NULL && kind == OTHER) {
            /* made first where it is lazy */
            Py_SETREF(record, PyObject_CallFunctionObjArgs(resolve, node, NULL));
            kind = record == NULL ? -1 : kind_of(PyTuple_GET_ITEM(record, 0));
        }
        operands = record == NULL || kind < 0 ? NULL : operands_of(record, kind, nodes, occurrences);
        pushed = operands == NULL ? -1 : push_missing(stack, index, operands);
        if (pushed < 0) goto done;
        if (pushed == 0) {
            place = PyLong_FromSsize_t(PyList_GET_SIZE(nodes));
            if (place == NULL || PyDict_SetItem(index, key, place) < 0 || PyList_Append(nodes, node) < 0 ||
                PyList_Append(records, record) < 0) {
                goto done;
            }
        }
    }
    status = pushed ? 0 : PyList_SetSlice(stack, top, top + 1, NULL);
done:
    Py_DECREF(node);
    Py_XDECREF(record);
    Py_XDECREF(operands);
    Py_XDECREF(place);
    Py_XDECREF(key);
    return status;
}

/* As `Graph._add` in graph.py. */
static PyObject *add_nodes(PyObject *module, PyObject *args)
{
    PyObject *root, *nodes, *records, *index, *occurrences;
    if (!PyArg_ParseTuple(args, "OO!O!O!O!:add_nodes", &root, &PyList_Type, &nodes, &PyList_Type, &records,
                          &PyDict_Type, &index, &PyDict_Type, &occurrences)) {
        return NULL;
    }
    PyObject *stack = PyList_New(0);
    int failed = stack == NULL || PyList_Append(stack, root) < 0;
    while (!failed && PyList_GET_SIZE(stack) > 0) failed = visit_top(stack, nodes, records, index, occurrences) < 0;
    Py_XDECREF(stack);
    if (failed) return NULL;
    Py_RETURN_NONE;
}

/* Whether it shows, without any Python, that values are made alike; 0 where it does not, or not in so many pairs. */
static int show_alike(PyObject *one, PyObject *other, int *pairs)
{
    while (one != other) {
        if (Py_TYPE(one) != Py_TYPE(other) || !IS_OURS(one) || --*pairs < 0) return 0;
        Record *record = record_of(one), *other_record = record_of(other);
        if (record->form != other_record->form) return 0;
        if (record->form == source_form) return record->first == other_record->first;
        if (record->kind == OTHER) return 0;
        if (!IS_SINGLE(record->kind) && !show_alike(record->second, other_record->second, pairs)) return 0;
        one = record->first;
        other = other_record->first;
    }
    return 1;
}

/* As `is_made_alike` in tracked.py where it is True; False where that has to do it. */
static PyObject *made_alike(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 2) return PyErr_Format(PyExc_TypeError, "made_alike(value, other)");
    int pairs = 256;
    return PyBool_FromLong(show_alike(args[0], args[1], &pairs));
}

/* As `select_tracked` in tracked.py. */
static PyObject *select_tracked(PyObject *module, PyObject *args)
{
    PyObject *values, *kinds, *found;
    Py_ssize_t index;
    if (!PyArg_ParseTuple(args, "O!nO!O!:select_tracked", &PyTuple_Type, &values, &index, &PyTuple_Type, &kinds,
                          &PyList_Type, &found)) {
        return NULL;
    }
    Py_ssize_t count = PyTuple_GET_SIZE(values);
    if (PyTuple_GET_SIZE(kinds) != count) return PyErr_Format(PyExc_ValueError, "a kind for each value");
    for (Py_ssize_t at = 0; at < count; at++) {
        PyObject *value = PyTuple_GET_ITEM(values, at);
        if (PyFloat_CheckExact(value) || PyLong_CheckExact(value) || PyUnicode_CheckExact(value)) continue;
        int is_tracked = IS_OURS(value) ? 1 : PySet_Contains(tracked_classes, (PyObject *)Py_TYPE(value));
        if (is_tracked == 0) continue;
        PyObject *number = is_tracked < 0 ? NULL : PyLong_FromSsize_t(index + at);
        PyObject *leaf = number == NULL ? NULL : PyTuple_Pack(3, number, value, PyTuple_GET_ITEM(kinds, at));
        int failed = leaf == NULL || PyList_Append(found, leaf) < 0;
        Py_XDECREF(number);
        Py_XDECREF(leaf);
        if (failed) return NULL;
    }
    Py_RETURN_NONE;
}

/* --- folds --------------------------------------------------------------------------------------------------- */

/* A node below a value that is folded, and its slope as far as that is added up. What is referred to is held. */
typedef struct {
    PyObject *node, *form, *first, *second;
    double weight;
    int kind, is_whole; /* whether the weight is an int in Python */
} Below;

typedef struct {
    Below *nodes;       /* in the order in which they were found */
    Py_ssize_t *order;  /* operands before their users, left before right */
    Py_ssize_t *places; /* of the nodes, by the hash of their addresses; -1 where there is none */
    Py_ssize_t count, ordered, room;
} Sweep;

/* What Python has to do: no error, but no answer. */
enum { FAILED = -1, DONE, NOT_HERE };

#define MOST_EXACT 9007199254740992.0 /* all whole numbers up to here are floats */

static Py_ssize_t *place_in(const Sweep *sweep, const PyObject *node)
{
    size_t mask = 2 * (size_t)sweep->room - 1, at = ((uintptr_t)node >> 4) * 0x9E3779B97F4A7C15u >> 20 & mask;
    while (sweep->places[at] >= 0 && sweep->nodes[sweep->places[at]].node != node) at = (at + 1) & mask;
    return &sweep->places[at];
}

/* Make room for twice as many nodes. */
static int grow(Sweep *sweep)
{
    Py_ssize_t room = sweep->room ? 2 * sweep->room : 256;
    Below *nodes = PyMem_Realloc(sweep->nodes, (size_t)room * sizeof *nodes);
    if (nodes != NULL) sweep->nodes = nodes;
    Py_ssize_t *order = PyMem_Realloc(sweep->order, (size_t)room * sizeof *order);
    if (order != NULL) sweep->order = order;
    Py_ssize_t *places = PyMem_Realloc(sweep->places, 2 * (size_t)room * sizeof *places);
    if (places != NULL) sweep->places = places;
    if (nodes == NULL || order == NULL || places == NULL) {
        PyErr_NoMemory();
        return FAILED;
    }
    sweep->room = room;
    for (Py_ssize_t at = 0; at < 2 * room; at++) places[at] = -1;
    for (Py_ssize_t at = 0; at < sweep->count; at++) *place_in(sweep, nodes[at].node) = at;
    return DONE;
}

/* Put a node among those found, with its fold or its record. */
static int find(Sweep *sweep, PyObject *node)
{
    if (!IS_OURS(node)) return NOT_HERE;
    if (sweep->count == sweep->room && grow(sweep) != DONE) return FAILED;
    Below *below = &sweep->nodes[sweep->count];
    Record *record = record_of(node);
    PyObject *fold = record->fold, *used;
    below->kind = record->kind;
    if (fold != NULL) {
        if (!PyTuple_CheckExact(fold) || PyTuple_GET_SIZE(fold) != 3) return NOT_HERE;
        Py_INCREF(fold);
        used = fold;
        below->kind = OTHER;
    } else if (record->form == lazy_form) {
        used = PyObject_CallFunctionObjArgs(resolve, node, NULL);
        if (used != NULL && (!PyTuple_CheckExact(used) || PyTuple_GET_SIZE(used) != 3)) Py_CLEAR(used);
        below->kind = used == NULL ? FAILED : kind_of(PyTuple_GET_ITEM(used, 0));
    } else {
        used = get_record(node, NULL);
    }
    if (used == NULL || below->kind < 0) {
        Py_XDECREF(used);
        return PyErr_Occurred() ? FAILED : NOT_HERE;
    }
    below->form = PyTuple_GET_ITEM(used, 0);
    below->first = PyTuple_GET_ITEM(used, 1);
    below->second = PyTuple_GET_ITEM(used, 2);
    below->node = node;
    below->weight = 0.0;
    below->is_whole = 1;
    Py_INCREF(below->form);
    Py_INCREF(below->first);
    Py_INCREF(below->second);
    Py_INCREF(node);
    Py_DECREF(used);
    *place_in(sweep, node) = sweep->count++;
    return DONE;
}

/* How many operands a node has; -1 where Python alone knows. */
static Py_ssize_t operand_count(const Below *below)
{
    if (IS_SINGLE(below->kind)) return 1;
    if (below->kind != OTHER) return 2;
    if (below->form == source_form) return 0;
    if (below->form == affine_form && PyTuple_CheckExact(below->first)) return PyTuple_GET_SIZE(below->first);
    return -1;
}

static PyObject *operand_at(const Below *below, Py_ssize_t at)
{
    if (below->kind != OTHER) return at == 0 ? below->first : below->second;
    PyObject *term = PyTuple_GET_ITEM(below->first, at);
    return PyTuple_CheckExact(term) && PyTuple_GET_SIZE(term) == 2 ? PyTuple_GET_ITEM(term, 0) : Py_None;
}

/* Find all nodes below a value, and their order. */
static int find_all(Sweep *sweep, PyObject *value)
{
    struct Step {
        PyObject *node;   /* to be found, held by its user; NULL where it was */
        Py_ssize_t place; /* its place, once it was found */
    } *stack = NULL;
    Py_ssize_t height = 0, room = 0;
    int status = grow(sweep);
    for (PyObject *next = value; status == DONE;) {
        if (next != NULL && *place_in(sweep, next) < 0) {
            status = find(sweep, next);
            if (status != DONE) break;
            Py_ssize_t place = sweep->count - 1, count = operand_count(&sweep->nodes[place]);
            if (count < 0) {
                status = NOT_HERE;
                break;
            }
            if (height + count + 1 > room) {
                room = 2 * room + count + 64;
                struct Step *larger = PyMem_Realloc(stack, (size_t)room * sizeof *stack);
                if (larger == NULL) {
                    PyErr_NoMemory();
                    status = FAILED;
                    break;
                }
                stack = larger;
            }
            stack[height++] = (struct Step){NULL, place};
            for (Py_ssize_t at = count - 1; at >= 0; at--) {
                stack[height++] = (struct Step){operand_at(&sweep->nodes[place], at), 0};
            }
        }
        if (height == 0) break;
        struct Step top = stack[--height];
        next = top.node;
        if (next == NULL) sweep->order[sweep->ordered++] = top.place;
    }
    PyMem_Free(stack);
    return status;
}

/* A slope as a double; 0 where it is no number of which this knows all digits. */
static int as_slope(PyObject *x, double *number, int *is_whole)
{
    *is_whole = PyLong_CheckExact(x);
    return as_double(x, number) && (!*is_whole || fabs(*number) <= MOST_EXACT);
}

/* Add a slope for an operand to its weight; whether the sum is a float. */
static int add_weight(Sweep *sweep, PyObject *operand, const Below *user, double slope, int is_whole, int *is_exact)
{
    Below *below = &sweep->nodes[*place_in(sweep, operand)];
    double part = user->weight * slope, total = below->weight + part;
    int whole = is_whole && user->is_whole && below->is_whole;
    if (is_whole && user->is_whole && fabs(part) > MOST_EXACT) return NOT_HERE;
    if (whole && fabs(total) > MOST_EXACT) return NOT_HERE;
    if (!isfinite(total)) {
        *is_exact = 0;
        total = 0.0;
        whole = 1;
    }
    below->weight = total;
    below->is_whole = whole;
    return DONE;
}

/* The slopes of an operator on numbers, as the table has them; NOT_HERE for others. */
static int slopes_of(const Below *below, double slopes[2], int are_whole[2])
{
    double first, second;
    int of_first, of_second;
    PyObject *other = below->second;
    if (below->kind < OPERATOR || OPERATOR_OF(below->kind) > DIVIDE) return NOT_HERE;
    int side = SIDE_OF(below->kind), operator = OPERATOR_OF(below->kind);
    PyObject *a = plain_of(below->first), *b = side == BOTH ? plain_of(other) : other;
    int are_numbers = a != NULL && b != NULL && as_slope(a, &first, &of_first) && as_slope(b, &second, &of_second);
    Py_XDECREF(a);
    if (side == BOTH) Py_XDECREF(b);
    if (!are_numbers) return PyErr_Occurred() ? FAILED : NOT_HERE;
    if (side == RIGHT) {
        /* the constant stands on the left */
        double number = first;
        int whole = of_first;
        first = second, of_first = of_second;
        second = number, of_second = whole;
    }
    slopes[0] = slopes[1] = 1.0;
    are_whole[0] = are_whole[1] = 1;
    if (operator == SUBTRACT) slopes[1] = -1.0;
    if (operator == MULTIPLY) {
        slopes[0] = second, are_whole[0] = of_second;
        slopes[1] = first, are_whole[1] = of_first;
    }
    if (operator == DIVIDE) {
        if (second == 0.0) return NOT_HERE;
        slopes[0] = 1.0 / second;
        slopes[1] = -first / second / second;
        are_whole[0] = are_whole[1] = 0;
    }
    for (int at = 0; at < 2; at++) {
        if (!isfinite(slopes[at])) slopes[at] = 0.0, are_whole[at] = 1;
    }
    if (side == RIGHT) slopes[0] = slopes[1], are_whole[0] = are_whole[1];
    return DONE;
}

/* Pass the weight of a node of an operator on to its operands. */
static int pass_on_operator(Sweep *sweep, const Below *below, const double slopes[2], const int are_whole[2],
                            int *is_exact)
{
    int operator = OPERATOR_OF(below->kind), side = SIDE_OF(below->kind);
    if (operator == MULTIPLY && side == BOTH) *is_exact = 0;
    if (operator == DIVIDE && side != LEFT) *is_exact = 0;
    if (side != BOTH && slopes[0] == 0.0) {
        PyObject *zero = below->second;
        double number;
        /* a slope of 0 may stand for one that no float can hold */
        if (operator != MULTIPLY || !as_double(zero, &number) || number != 0.0) *is_exact = 0;
    }
    int status = add_weight(sweep, below->first, below, slopes[0], are_whole[0], is_exact);
    if (status == DONE && side == BOTH) {
        status = add_weight(sweep, below->second, below, slopes[1], are_whole[1], is_exact);
    }
    return status;
}

/* The same for one of any other operation, of which Python knows the slopes. */
static int pass_on_other(Sweep *sweep, const Below *below, int *is_exact)
{
    PyObject *slopes = NULL, *record = NULL, *plains = NULL;
    int status = FAILED, is_affine = truth_of(below->form, str_affine);
    Py_ssize_t count = operand_count(below);
    if (is_affine < 0) return FAILED;
    *is_exact = *is_exact && is_affine;
    record = PyTuple_Pack(3, below->form, below->first, below->second);
    plains = PyTuple_New(count);
    for (Py_ssize_t at = 0; record != NULL && plains != NULL && at < count; at++) {
        PyObject *plain = plain_of(operand_at(below, at));
        if (plain == NULL) goto done;
        PyTuple_SET_ITEM(plains, at, plain);
    }
    if (record == NULL || plains == NULL) goto done;
    slopes = PyObject_CallFunctionObjArgs(slopes_or_zeros, record, plains, NULL);
    if (slopes == NULL) goto done;
    Py_SETREF(slopes, PySequence_Fast(slopes, "slopes are a sequence"));
    if (slopes == NULL || PySequence_Fast_GET_SIZE(slopes) != count) goto done;
    for (Py_ssize_t at = 0; at < count; at++) {
        double slope;
        int is_whole;
        status = NOT_HERE;
        if (!as_slope(PySequence_Fast_GET_ITEM(slopes, at), &slope, &is_whole)) goto done;
        if (IS_SINGLE(below->kind) && slope == 0.0) *is_exact = 0;
        status = add_weight(sweep, operand_at(below, at), below, slope, is_whole, is_exact);
        if (status != DONE) goto done;
    }
    status = DONE;
done:
    if (status == FAILED && !PyErr_Occurred()) status = NOT_HERE;
    Py_XDECREF(slopes);
    Py_XDECREF(record);
    Py_XDECREF(plains);
    return status;
}

/* The same for a fold. */
static int pass_on_fold(Sweep *sweep, const Below *below, int *is_exact)
{
    int truth = PyObject_IsTrue(below->second);
    if (truth < 0) return FAILED;
    *is_exact = *is_exact && truth;
    for (Py_ssize_t at = 0; at < PyTuple_GET_SIZE(below->first); at++) {
        double slope;
        int is_whole;
        if (!as_slope(PyTuple_GET_ITEM(PyTuple_GET_ITEM(below->first, at), 1), &slope, &is_whole)) return NOT_HERE;
        int status = add_weight(sweep, operand_at(below, at), below, slope, is_whole, is_exact);
        if (status != DONE) return status;
    }
    return DONE;
}

/* Add up the slopes of the last node in the order for all others. */
static int pass_on_all(Sweep *sweep, int *is_exact)
{
    Below *root = &sweep->nodes[sweep->order[sweep->ordered - 1]];
    root->weight = 1.0;
    for (Py_ssize_t at = sweep->ordered - 1; at >= 0; at--) {
        const Below *below = &sweep->nodes[sweep->order[at]];
        double slopes[2];
        int are_whole[2], status;
        if (below->form == source_form) continue;
        if (below->kind == OTHER) {
            status = pass_on_fold(sweep, below, is_exact);
        } else {
            status = slopes_of(below, slopes, are_whole);
            if (status == DONE) status = pass_on_operator(sweep, below, slopes, are_whole, is_exact);
            else if (status == NOT_HERE) status = pass_on_other(sweep, below, is_exact);
        }
        if (status != DONE) return status;
    }
    return DONE;
}

/* `[(source's value, slope), ...]` of a sweep. */
static PyObject *leaves_of(const Sweep *sweep)
{
    PyObject *leaves = PyList_New(0);
    for (Py_ssize_t at = 0; leaves != NULL && at < sweep->ordered; at++) {
        const Below *below = &sweep->nodes[sweep->order[at]];
        if (below->form != source_form) continue;
        PyObject *slope = below->is_whole ? PyLong_FromDouble(below->weight) : PyFloat_FromDouble(below->weight);
        PyObject *leaf = slope == NULL ? NULL : PyTuple_Pack(2, below->node, slope);
        if (leaf == NULL || PyList_Append(leaves, leaf) < 0) Py_CLEAR(leaves);
        Py_XDECREF(slope);
        Py_XDECREF(leaf);
    }
    return leaves;
}

/* As `_swept` in affine.py; NotImplemented where that has to do it. */
static PyObject *swept(PyObject *module, PyObject *value)
{
    Sweep sweep = {NULL, NULL, NULL, 0, 0, 0};
    int is_exact = 1, status = find_all(&sweep, value);
    if (status == DONE) status = pass_on_all(&sweep, &is_exact);
    PyObject *leaves = status == DONE ? leaves_of(&sweep) : NULL, *result = NULL;
    if (leaves != NULL) result = PyTuple_Pack(2, leaves, is_exact ? Py_True : Py_False);
    if (status == NOT_HERE) result = not_here();
    Py_XDECREF(leaves);
    for (Py_ssize_t at = 0; at < sweep.count; at++) {
        Py_DECREF(sweep.nodes[at].form);
        Py_DECREF(sweep.nodes[at].first);
        Py_DECREF(sweep.nodes[at].second);
        Py_DECREF(sweep.nodes[at].node);
    }
    PyMem_Free(sweep.nodes);
    PyMem_Free(sweep.order);
    PyMem_Free(sweep.places);
    return result;
}

/* --- reading locations --------------------------------------------------------------------------------------- */

#if PY_VERSION_HEX < 0x03090000
#define PyObject_Vectorcall _PyObject_Vectorcall
#endif

/* Where the Python code that runs calls something: what `known` has the calls by (`Locations.by_call`), but for the name
   and the key that they give. */
static PyObject *place_of_call(PyObject *name, PyObject *key)
{
    PyFrameObject *frame = PyEval_GetFrame();
    if (frame == NULL) return PyErr_Format(PyExc_RuntimeError, "called by no Python code");
#if PY_VERSION_HEX >= 0x030B0000
    PyCodeObject *code = PyFrame_GetCode(frame);
    Py_DECREF(code); /* the frame has it */
    int offset = PyFrame_GetLasti(frame);
#else
    PyCodeObject *code = frame->f_code;
    int offset = frame->f_lasti * (PY_VERSION_HEX >= 0x030A0000 ? 2 : 1);
#endif
    PyObject *number = PyLong_FromVoidPtr(code), *at = PyLong_FromLong(offset);
    PyObject *place = number && at ? PyTuple_Pack(4, number, at, name, key) : NULL;
    Py_XDECREF(number);
    Py_XDECREF(at);
    return place;
}

/* A call of the function that `reading` was given: what a call with a value at this place reads, if it is known. */
static PyObject *read_known(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *words)
{
    PyObject *value = count > 0 ? args[0] : Py_None, *name = count > 1 ? args[1] : Py_None,
             *key = count > 2 ? args[2] : Py_None;
    for (Py_ssize_t at = 0; words != NULL && at < PyTuple_GET_SIZE(words); at++) {
        PyObject *word = PyTuple_GET_ITEM(words, at), *given = args[count + at];
        if (word == str_name) {
            name = given;
        } else if (word == str_key) {
            key = given;
        } else if (word == str_value) {
            value = given;
        } else if (word == str_getter || !PyUnicode_CHECK_INTERNED(word)) {
            value = Py_None;
            break;
        }
    }
    if (value != Py_None) {
        PyObject *place = place_of_call(name, key);
        PyObject *found = place ? PyDict_GetItemWithError(PyTuple_GET_ITEM(self, 1), place) : NULL, *read = NULL;
        Py_XINCREF(found);
        Py_XDECREF(place);
        if (found != NULL) read = PyObject_GetAttr(found, str_tracked);
        Py_XDECREF(found);
        if (read != NULL || PyErr_Occurred()) return read;
    }
    return PyObject_Vectorcall(PyTuple_GET_ITEM(self, 0), args, (size_t)count, words);
}

/* As `reading` in accelerator.py. What it makes is there as long as the process. */
static PyObject *reading(PyObject *module, PyObject *args)
{
    PyObject *function, *known, *made = NULL;
    const char *name, *doc;
    if (!PyArg_ParseTuple(args, "OO!ss:reading", &function, &PyDict_Type, &known, &name, &doc)) return NULL;
    PyMethodDef *definition = PyMem_Malloc(sizeof *definition);
    if (definition == NULL) return PyErr_NoMemory();
    definition->ml_name = name;
    definition->ml_doc = doc;
    definition->ml_meth = (PyCFunction)(void (*)(void))read_known;
    definition->ml_flags = METH_FASTCALL | METH_KEYWORDS;
    /* the arguments are kept, as the texts are theirs */
    PyObject *self = PyTuple_Pack(3, function, known, args), *home = PyObject_GetAttrString(function, "__module__");
    if (self != NULL && home != NULL) made = PyCFunction_NewEx(definition, self, home);
    Py_XDECREF(self);
    Py_XDECREF(home);
    return made;
}

/* --- the module ---------------------------------------------------------------------------------------------- */

/* Tell the core what it records and what it hands over. */
static PyObject *complete(PyObject *module, PyObject *args)
{
    PyObject *of_operators, *of_fallbacks, *told[10];
    if (!PyArg_ParseTuple(args, "O!O!OOOOOOO!O!OOii:complete", &PyTuple_Type, &of_operators, &PyTuple_Type, &of_fallbacks,
                          &told[0], &told[1], &told[2], &told[3], &told[4], &told[5], &PyTuple_Type, &told[6],
                          &PyFrozenSet_Type, &told[7], &told[8], &told[9], &limit, &max_shared_size)) {
        return NULL;
    }
    if (PyTuple_GET_SIZE(of_operators) != 3 * OPERATORS || PyTuple_GET_SIZE(of_fallbacks) != OPERATORS) {
        PyErr_SetString(PyExc_ValueError, "three forms and a fallback of each operator");
        return NULL;
    }
    PyObject **places[] = {&negation, &source_form, &lazy_form,      &shorten,
                           &resolve,  &new_other,   &source_classes, &tracked_classes,
                           &affine_form, &slopes_or_zeros};
    for (int at = 0; at < 3 * OPERATORS; at++) {
        Py_INCREF(PyTuple_GET_ITEM(of_operators, at));
        Py_XSETREF(forms[at], PyTuple_GET_ITEM(of_operators, at));
    }
    for (int at = 0; at < OPERATORS; at++) {
        Py_INCREF(PyTuple_GET_ITEM(of_fallbacks, at));
        Py_XSETREF(fallbacks[at], PyTuple_GET_ITEM(of_fallbacks, at));
    }
    for (int at = 0; at < 10; at++) {
        Py_INCREF(told[at]);
        Py_XSETREF(*places[at], told[at]);
    }
    Py_RETURN_NONE;
}

static PyMethodDef functions[] = {
    {"complete", complete, METH_VARARGS, "Tell the core what it records and what it hands over; once, before all."},
    {"new", (PyCFunction)(void (*)(void))new_value, METH_FASTCALL, "new(value, record, size): a tracked float or int."},
    {"along_chain", (PyCFunction)(void (*)(void))along_chain, METH_FASTCALL,
     "along_chain(value, {Source: value}): the value of a chain on one source, or NotImplemented."},
    {"solve_chain", (PyCFunction)(void (*)(void))solve_chain, METH_FASTCALL,
     "solve_chain(value, target, relative): {Source: value}, None without an answer, or NotImplemented."},
    {"add_nodes", add_nodes, METH_VARARGS, "add_nodes(root, nodes, records, index, occurrences): as Graph does."},
    {"select_tracked", select_tracked, METH_VARARGS, "select_tracked(values, index, kinds, found): as in tracked.py."},
    {"swept", swept, METH_O, "swept(value): as in affine.py, or NotImplemented."},
    {"reading", reading, METH_VARARGS, "reading(function, known, name, doc): as in accelerator.py."},
    {"made_alike", (PyCFunction)(void (*)(void))made_alike, METH_FASTCALL,
     "made_alike(value, other): whether it is certain that they are; False as well where Python has to say it."},
    {NULL, NULL, 0, NULL},
};

#define SLOTS                                                                                                         \
    {Py_tp_new, plain_new}, {Py_tp_dealloc, dealloc}, {Py_tp_traverse, traverse}, {Py_tp_clear, clear},               \
        {Py_tp_free, PyObject_GC_Del}, {Py_tp_getset, attributes}, {Py_nb_add, add}, {Py_nb_subtract, subtract},      \
        {Py_nb_multiply, multiply}, {Py_nb_true_divide, divide}, {Py_nb_floor_divide, floor_divide},                  \
        {Py_nb_remainder, remainder_of}, {Py_nb_negative, negate}

static PyType_Slot float_slots[] = {
    SLOTS,
    {Py_tp_doc, "A float with provenance. Made by `track` and by arithmetic; calling the class gives a plain float."},
    {0, NULL},
};
static PyType_Slot int_slots[] = {
    SLOTS,
    {Py_tp_doc, "An int with provenance."},
    {0, NULL},
};
#define FLAGS (Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC)
static PyType_Spec float_spec = {"rosslt.values.tracked.TrackedFloat", sizeof(Float), 0, FLAGS, float_slots};
/* room for the part behind the digits, wherever it begins */
static PyType_Spec int_spec = {"rosslt.values.tracked.TrackedInt",
                               offsetof(PyLongObject, ob_digit) + sizeof(void *) + sizeof(IntPart), sizeof(digit),
                               FLAGS, int_slots};

static PyTypeObject *type_of(PyType_Spec *spec, PyTypeObject *base)
{
    PyObject *bases = PyTuple_Pack(1, base), *type = bases ? PyType_FromSpecWithBases(spec, bases) : NULL;
    Py_XDECREF(bases);
    /* error messages call it by its short name, as they do a class of Python */
    const char *dot = strrchr(spec->name, '.');
    PyObject *name = type ? PyUnicode_FromString(dot + 1) : NULL;
    if (name == NULL || PyObject_SetAttrString(type, "__name__", name) < 0) Py_CLEAR(type);
    Py_XDECREF(name);
    return (PyTypeObject *)type;
}

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "rosslt._core", "The compiled core of rosslt.values.", -1, functions, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__core(void)
{
    struct {
        PyObject **place;
        const char *text;
    } names[] = {{&str_forward, "forward"},     {&str_inverse, "inverse"},   {&str_single_operand, "single_operand"},
                 {&str_operation, "operation"}, {&str_operands, "operands"}, {&str_record, "_record"},
                 {&str_affine, "affine"},
                 {&str_value, "value"},         {&str_name, "name"},         {&str_key, "key"},
                 {&str_getter, "getter"},       {&str_tracked, "tracked"}};
    for (size_t at = 0; at < sizeof names / sizeof *names; at++) {
        *names[at].place = PyUnicode_InternFromString(names[at].text);
        if (*names[at].place == NULL) return NULL;
    }
    FloatType = type_of(&float_spec, &PyFloat_Type);
    IntType = type_of(&int_spec, &PyLong_Type);
    PyObject *module = FloatType && IntType ? PyModule_Create(&definition) : NULL;
    if (module == NULL) return NULL;
    Py_INCREF(FloatType);
    Py_INCREF(IntType);
    if (PyModule_AddObject(module, "TrackedFloat", (PyObject *)FloatType) < 0 ||
        PyModule_AddObject(module, "TrackedInt", (PyObject *)IntType) < 0 ||
        PyModule_AddIntConstant(module, "INTERFACE", INTERFACE) < 0) {
        Py_DECREF(module);
        return NULL;
    }
    return module;
}
