/* What is the value of a chain of operations on one source where that has another one, and which other one does it
   need? As `evaluate` and `solve` of any expression, on doubles without an object each as far as that goes. */

#include "core.h"

/* The values between a value and its one source, the source's last, in a list; NULL without an error where there is no
   such chain, or it is not all of the core. */
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

/* What a function of a record's form, forward or inverse, gives for one or two values and the record's constant. */
static PyObject *call(const Record *record, int name, PyObject *a, PyObject *b)
{
    PyObject *form = Py_NewRef(record->form), *second = Py_NewRef(record->second), *result = NULL;
    PyObject *function = PyObject_GetAttr(form, names[name]);
    if (function != NULL) {
        result = PyObject_CallFunctionObjArgs(function, a, b ? b : second, b ? second : NULL, NULL);
        Py_DECREF(function);
    }
    Py_DECREF(form);
    Py_DECREF(second);
    return result;
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
            Py_SETREF(value, Py_NewRef(Py_NotImplemented));
            break;
        } else {
            Py_SETREF(value, call(record, FORWARD, value, NULL));
            at--;
        }
    }
    return value;
}

/* The value of a chain; NotImplemented where it is none. */
PyObject *along_chain(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 2) return PyErr_Format(PyExc_TypeError, "along_chain(value, changes)");
    PyObject *chain = PyDict_CheckExact(args[1]) ? follow(args[0]) : NULL, *value = NULL;
    if (chain != NULL) {
        PyObject *source = Py_NewRef(record_of(LAST(chain))->first);
        value = PyDict_GetItemWithError(args[1], source);
        Py_XINCREF(value);
        Py_DECREF(source);
    }
    if (value != NULL) {
        value = run(chain, value);
    } else if (!PyErr_Occurred()) {
        value = Py_NewRef(Py_NotImplemented);
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
    if (!isfinite(target)) Py_RETURN_NOTIMPLEMENTED;
    for (Py_ssize_t at = 0; at < PyList_GET_SIZE(chain) - 1; at++) {
        Record *record = record_of(PyList_GET_ITEM(chain, at));
        if (backwards(record->kind, wanted, record->second, &wanted)) continue;
        if (!IS_SINGLE(record->kind)) Py_RETURN_NOTIMPLEMENTED;
        PyObject *number = PyFloat_FromDouble(wanted), *operand = plain_of(record->first);
        found = number && operand ? call(record, INVERSE, number, operand) : NULL;
        Py_XDECREF(number);
        Py_XDECREF(operand);
        if (found == NULL) return none_for_error();
        int is_float = PyFloat_CheckExact(found);
        wanted = is_float ? PyFloat_AS_DOUBLE(found) : 0.0;
        Py_DECREF(found);
        if (!is_float) Py_RETURN_NOTIMPLEMENTED;
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
    PyObject *source = Py_NewRef(record_of(leaf)->first), *number = PyFloat_FromDouble(wanted), *answer = PyDict_New();
    if (number == NULL || answer == NULL || PyDict_SetItem(answer, source, number) < 0) Py_CLEAR(answer);
    Py_DECREF(source);
    Py_XDECREF(number);
    return answer;
}

/* The answer for a chain of operations on one float source; NotImplemented where it is none, None where `solve` has to
   look closer. */
PyObject *solve_chain(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 3 || !PyFloat_CheckExact(args[2])) {
        return PyErr_Format(PyExc_TypeError, "solve_chain(value, target, relative)");
    }
    PyObject *chain = IS_FLOAT(args[0]) && PyFloat_CheckExact(args[1]) ? follow(args[0]) : NULL, *answer = NULL;
    if (chain != NULL && IS_FLOAT(LAST(chain))) {
        answer = solved(chain, PyFloat_AS_DOUBLE(args[1]), PyFloat_AS_DOUBLE(args[2]));
    } else if (!PyErr_Occurred()) {
        answer = Py_NewRef(Py_NotImplemented);
    }
    Py_XDECREF(chain);
    return answer;
}
