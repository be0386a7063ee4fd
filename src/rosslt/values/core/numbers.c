/* What is a tracked float or int? Their classes, their records, and the arithmetic that records (`operators.py`). */

#include "core.h"

PyTypeObject *FloatType, *IntType;

PyObject *plain_of(PyObject *x)
{
    if (IS_FLOAT(x)) {
        Float *self = (Float *)x;
        if (self->plain == NULL) self->plain = PyFloat_FromDouble(self->value.ob_fval);
        Py_XINCREF(self->plain);
        return self->plain;
    }
    if (IS_INT(x)) return Py_NewRef(int_part(x)->plain);
    return PyFloat_CheckExact(x) || PyLong_CheckExact(x) ? Py_NewRef(x) : NULL;
}

/* --- records ------------------------------------------------------------------------------------------------- */

int truth_of(PyObject *thing, int name)
{
    PyObject *found = PyObject_GetAttr(thing, names[name]);
    int truth = found == NULL ? -1 : PyObject_IsTrue(found);
    Py_XDECREF(found);
    return truth;
}

int kind_of(PyObject *form)
{
    if (form == source_form || form == lazy_form) return OTHER;
    for (int number = 0; number < 3 * OPERATORS; number++) if (form == forms[number]) return OPERATOR + number;
    int truth = truth_of(form, SINGLE_OPERAND);
    if (truth != 0) return truth < 0 ? -1 : ANY_SINGLE;
    PyObject *operation = PyObject_GetAttr(form, names[OPERATION]);
    int kind = operation == NULL ? -1 : operation == Py_None ? OTHER : ANY_BOTH;
    Py_XDECREF(operation);
    return kind;
}

/* The kind of something that is to be a record; -1 with an error. */
static int kind_of_record(PyObject *x)
{
    if (x != NULL && is_record(x)) return kind_of(PyTuple_GET_ITEM(x, 0));
    PyErr_SetString(PyExc_TypeError, "a record is a tuple (form, first, second)");
    return -1;
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

static inline void set_record(Record *record, PyObject *form, PyObject *first, PyObject *second, int kind)
{
    Py_INCREF(form);
    Py_INCREF(first);
    Py_INCREF(second);
    record->form = form;
    record->first = first;
    record->second = second;
    record->kind = (unsigned char)kind;
}

static void replace_record(Record *record, PyObject *form, PyObject *first, PyObject *second, int kind)
{
    PyObject *old[] = {record->form, record->first, record->second};
    set_record(record, form, first, second, kind);
    for (int at = 0; at < 3; at++) Py_DECREF(old[at]);
}

static PyObject *get_record(PyObject *self, void *unused)
{
    Record *record = record_of(self);
    return PyTuple_Pack(3, record->form, record->first, record->second);
}

PyObject *resolved(PyObject *value, int *kind)
{
    PyObject *record;
    if (IS_OURS(value)) {
        *kind = record_of(value)->kind;
        record = get_record(value, NULL);
    } else {
        record = PyObject_GetAttr(value, names[RECORD]);
        *kind = record == NULL ? -1 : kind_of_record(record);
    }
    if (record != NULL && *kind == OTHER && PyTuple_GET_ITEM(record, 0) == lazy_form) {
        Py_SETREF(record, PyObject_CallFunctionObjArgs(resolve, value, NULL));
        *kind = record == NULL ? -1 : kind_of_record(record);
    }
    if (*kind < 0) Py_CLEAR(record);
    return record;
}

/* --- new values ---------------------------------------------------------------------------------------------- */

static inline void fill(Record *record, PyObject *form, PyObject *first, PyObject *second, int kind, Py_ssize_t size)
{
    set_record(record, form, first, second, kind);
    record->fold = NULL;
    record->size = (int)size;
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
    PyLongObject *self = PyObject_GC_NewVar(PyLongObject, IntType, digits_of(plain));
    if (self != NULL) {
        ((PyVarObject *)self)->ob_size = Py_SIZE(plain);
        memcpy(self->ob_digit, ((PyLongObject *)plain)->ob_digit, (size_t)digits_of(plain) * sizeof(digit));
        IntPart *part = int_part((PyObject *)self);
        fill(&part->record, form, first, second, kind, size);
        part->plain = Py_NewRef(plain);
    }
    return (PyObject *)self;
}

/* A value of any class. What may be part of a cycle is made known to the collector. */
static PyObject *new_of(PyObject *value, PyObject *form, PyObject *first, PyObject *second, int kind, long size)
{
    PyObject *result;
    if (PyFloat_CheckExact(value)) {
        result = new_float(PyFloat_AS_DOUBLE(value), form, first, second, kind, size);
        if (result != NULL) ((Float *)result)->plain = Py_NewRef(value);
    } else if (PyLong_CheckExact(value)) {
        result = new_int(value, form, first, second, kind, size);
    } else {
        return PyObject_CallFunction(new_other, "O(OOO)l", value, form, first, second, size);
    }
    if (result != NULL && form != source_form && form != affine_form &&
        (kind == OTHER || may_cycle(first) || may_cycle(second))) {
        collect(result, record_of(result));
    }
    return result;
}

PyObject *new_value(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 3 || !is_record(args[1])) {
        return PyErr_Format(PyExc_TypeError, "new(value, (form, first, second), size)");
    }
    PyObject *form = PyTuple_GET_ITEM(args[1], 0);
    long size = PyLong_AsLong(args[2]);
    int kind = size == -1 && PyErr_Occurred() ? -1 : kind_of(form);
    if (kind < 0) return NULL;
    return new_of(args[0], form, PyTuple_GET_ITEM(args[1], 1), PyTuple_GET_ITEM(args[1], 2), kind, size);
}

/* As in tracked.py. */
PyObject *lazy_of(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 2) return PyErr_Format(PyExc_TypeError, "lazy_of(values, load)");
    PyObject *values = PySequence_Tuple(args[0]);
    PyObject *results = values == NULL ? NULL : PyList_New(PyTuple_GET_SIZE(values));
    for (Py_ssize_t at = 0; results != NULL && at < PyTuple_GET_SIZE(values); at++) {
        PyObject *number = PyLong_FromSsize_t(at), *value = PyTuple_GET_ITEM(values, at);
        PyObject *result = number == NULL ? NULL : new_of(value, lazy_form, args[1], number, OTHER, 1);
        Py_XDECREF(number);
        if (result == NULL) Py_CLEAR(results);
        else PyList_SET_ITEM(results, at, result);
    }
    Py_XDECREF(values);
    return results;
}

/* --- arithmetic ---------------------------------------------------------------------------------------------- */

/* The result of an operation: an int, or a float where that is NULL. It is plain where no more may be recorded. It knows
   the collector if one of its operands does, and stays in the limit. */
static PyObject *finished(PyObject *whole, double value, PyObject *form, PyObject *first, PyObject *second, int kind,
                          Py_ssize_t size, int collected)
{
    int is_recorded = may_record();
    if (is_recorded <= 0) return is_recorded < 0 ? NULL : whole ? Py_NewRef(whole) : PyFloat_FromDouble(value);
    PyObject *result = whole ? new_int(whole, form, first, second, kind, size)
                             : new_float(value, form, first, second, kind, size);
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
    return finished(whole, value, forms[kind - OPERATOR], first, second, kind, size, collected);
}

PyObject *new_number(PyObject *value, PyObject *form, PyObject *first, PyObject *second, int kind)
{
    const Record *record = record_of(first);
    Py_ssize_t size = record->size + 1;
    int collected = record->collected;
    if (!IS_SINGLE(kind)) {
        size = joint_size(record->size, record_of(second)->size);
        collected = collected || record_of(second)->collected;
    }
    int is_float = PyFloat_CheckExact(value);
    return finished(is_float ? NULL : value, is_float ? PyFloat_AS_DOUBLE(value) : 0.0, form, first, second, kind, size,
                    collected);
}

/* What an operator gives that has something else than floats to do. */
static PyObject *recorded(int operator, PyObject *v, PyObject *w)
{
    static const binaryfunc compute[] = {PyNumber_Add,        PyNumber_Subtract,    PyNumber_Multiply,
                                         PyNumber_TrueDivide, PyNumber_FloorDivide, PyNumber_Remainder};
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

/* `v ** w`, whose results may be complex; whole numbers and a modulus are left to Python. */
static PyObject *power(PyObject *v, PyObject *w, PyObject *modulus)
{
    PyObject *a = NULL, *b = NULL, *value = NULL, *result = NULL;
    if (modulus != Py_None && !IS_OURS(v)) Py_RETURN_NOTIMPLEMENTED; /* as of a class of Python */
    if (modulus == Py_None && (HOLDS_FLOAT(v) || HOLDS_FLOAT(w))) {
        a = plain_of(v);
        b = plain_of(w);
    }
    if (a != NULL && b != NULL) {
        value = PyNumber_Power(a, b, Py_None);
    } else if (!PyErr_Occurred()) {
        result = PyObject_CallFunctionObjArgs(fallbacks[POWER], v, w, modulus, NULL);
    }
    Py_XDECREF(a);
    Py_XDECREF(b);
    if (value == NULL || !PyFloat_CheckExact(value)) return value == NULL ? result : value;
    result = result_of(POWER, v, w, NULL, PyFloat_AS_DOUBLE(value));
    Py_DECREF(value);
    return result;
}

/* What a function of a whole number gives, with the form that records it. */
static PyObject *single(PyObject *self, unaryfunc compute, PyObject *form)
{
    PyObject *plain = plain_of(self), *value = plain == NULL ? NULL : compute(plain), *result = NULL;
    Py_XDECREF(plain);
    if (value != NULL) result = new_number(value, form, self, Py_None, ANY_SINGLE);
    Py_XDECREF(value);
    return result;
}

static PyObject *single_float(PyObject *self, double value, PyObject *form)
{
    const Record *record = record_of(self);
    return finished(NULL, value, form, self, Py_None, ANY_SINGLE, record->size + 1, record->collected);
}

static PyObject *negate(PyObject *self)
{
    if (IS_FLOAT(self)) return single_float(self, -PyFloat_AS_DOUBLE(self), negation);
    return single(self, PyNumber_Negative, negation);
}

static PyObject *absolute(PyObject *self)
{
    if (IS_FLOAT(self)) return single_float(self, fabs(PyFloat_AS_DOUBLE(self)), absolute_form);
    return single(self, PyNumber_Absolute, absolute_form);
}

/* --- attributes ---------------------------------------------------------------------------------------------- */

static PyObject *get_plain(PyObject *self, void *unused)
{
    return plain_of(self);
}

static int put_record(PyObject *self, PyObject *value, void *unused)
{
    int kind = kind_of_record(value);
    if (kind < 0) return -1;
    Record *record = record_of(self);
    replace_record(record, PyTuple_GET_ITEM(value, 0), PyTuple_GET_ITEM(value, 1), PyTuple_GET_ITEM(value, 2), kind);
    if (record->form != affine_form) collect(self, record); /* folds refer to sources alone */
    return 0;
}

static PyObject *get_fold(PyObject *self, void *unused)
{
    PyObject *fold = record_of(self)->fold;
    /* an AttributeError, as of the Python, takes longer than what asks for it */
    return Py_NewRef(fold == NULL ? Py_None : fold);
}

static int put_fold(PyObject *self, PyObject *value, void *unused)
{
    Py_XINCREF(value);
    Py_XSETREF(record_of(self)->fold, value);
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

/* --- the classes --------------------------------------------------------------------------------------------- */

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

static int clear(PyObject *self)
{
    Record *record = record_of(self);
    replace_record(record, Py_None, Py_None, Py_None, OTHER);
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

/* Make a class and put it in the module by its short name, which is also what error messages call it by, as they do a
   class of Python. */
static PyTypeObject *add_class(PyObject *module, PyTypeObject *base, const char *name, size_t size, size_t item_size,
                               const char *doc)
{
    PyType_Slot slots[] = {
        {Py_tp_new, plain_new},
        {Py_tp_dealloc, dealloc},
        {Py_tp_traverse, traverse},
        {Py_tp_clear, clear},
        {Py_tp_free, PyObject_GC_Del},
        {Py_tp_getset, attributes},
        {Py_nb_add, add},
        {Py_nb_subtract, subtract},
        {Py_nb_multiply, multiply},
        {Py_nb_true_divide, divide},
        {Py_nb_floor_divide, floor_divide},
        {Py_nb_remainder, remainder_of},
        {Py_nb_power, power},
        {Py_nb_negative, negate},
        {Py_nb_absolute, absolute},
        {Py_tp_doc, (void *)doc},
        {0, NULL},
    };
    PyType_Spec spec = {name, (int)size, (int)item_size,
                        Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC, slots};
    const char *short_name = strrchr(name, '.') + 1;
    PyObject *bases = PyTuple_Pack(1, base), *type = bases ? PyType_FromSpecWithBases(&spec, bases) : NULL;
    PyObject *text = type ? PyUnicode_FromString(short_name) : NULL;
    if (text == NULL || PyObject_SetAttrString(type, "__name__", text) < 0 ||
        PyObject_SetAttrString(module, short_name, type) < 0) {
        Py_CLEAR(type);
    }
    Py_XDECREF(bases);
    Py_XDECREF(text);
    return (PyTypeObject *)type;
}

int add_classes(PyObject *module)
{
    FloatType = add_class(module, &PyFloat_Type, "rosslt.values.tracked.TrackedFloat", sizeof(Float), 0,
                          "A float with provenance. Made by `track` and by arithmetic; calling the class gives a plain "
                          "float.");
    if (FloatType == NULL) return -1;
    /* room for the part behind the digits, wherever it begins */
    IntType = add_class(module, &PyLong_Type, "rosslt.values.tracked.TrackedInt",
                        offsetof(PyLongObject, ob_digit) + sizeof(void *) + sizeof(IntPart), sizeof(digit),
                        "An int with provenance.");
    return IntType == NULL ? -1 : 0;
}
