/* What are the values of a graph's nodes if some have changed, and what are the slopes? `Graph.run`, `partials`, `tangent`
   and `gradient` of `graph.py`, on doubles, for the operations that positions and angles are made of: a tape has an
   entry for each node. */

#include "core.h"

enum { STILL, NEGATIVE, SINE, COSINE, OF_OPERATOR };

typedef struct {
    int kind, first, second;
    double constant;
} Entry;

typedef struct {
    double first, second;
} Slopes;

/* The kind of entry for a form; STILL if there is none, -1 with an error. */
static int kind_of_entry(PyObject *form)
{
    if (form == negation) return NEGATIVE;
    if (form == sine_form) return SINE;
    if (form == cosine_form) return COSINE;
    int kind = kind_of(form);
    return kind < OPERATOR ? (kind < 0 ? -1 : STILL) : OPERATOR_OF(kind) <= DIVIDE ? OF_OPERATOR + kind : STILL;
}

/* Put the index of an operand into an entry: 0 if that holds no float. */
static int take_operand(PyObject *index, PyObject *values, int *operand)
{
    long place = PyLong_AsLong(index);
    if (place < 0 || place >= PyList_GET_SIZE(values)) return 0;
    *operand = (int)place;
    return PyFloat_CheckExact(PyList_GET_ITEM(values, place));
}

PyObject *make_tape(PyObject *module, PyObject *args)
{
    PyObject *steps, *records, *values;
    if (!PyArg_ParseTuple(args, "O!O!O!:tape", &PyList_Type, &steps, &PyList_Type, &records, &PyList_Type, &values)) {
        return NULL;
    }
    Py_ssize_t size = PyList_GET_SIZE(values);
    PyObject *tape = PyBytes_FromStringAndSize(NULL, size * (Py_ssize_t)sizeof(Entry));
    if (tape == NULL) return NULL;
    Entry *entries = (Entry *)PyBytes_AS_STRING(tape);
    memset(entries, 0, (size_t)size * sizeof(Entry));
    for (Py_ssize_t at = 0; at < PyList_GET_SIZE(steps); at++) {
        PyObject *step = PyList_GET_ITEM(steps, at), *constant = PyTuple_GET_ITEM(step, 4);
        long place = PyLong_AsLong(PyTuple_GET_ITEM(step, 0));
        if (place < 0 || place >= size || place >= PyList_GET_SIZE(records)) goto unsuited;
        Entry *entry = entries + place;
        entry->kind = kind_of_entry(PyTuple_GET_ITEM(PyList_GET_ITEM(records, place), 0));
        if (entry->kind <= STILL || !take_operand(PyTuple_GET_ITEM(step, 2), values, &entry->first) ||
            !PyFloat_CheckExact(PyList_GET_ITEM(values, place))) {
            goto unsuited;
        }
        Slope known;
        if (PyTuple_GET_ITEM(step, 3) != Py_None) {
            if (!take_operand(PyTuple_GET_ITEM(step, 3), values, &entry->second)) goto unsuited;
        } else if (entry->kind >= OF_OPERATOR) {
            if (!as_slope(constant, &known)) goto unsuited;
            entry->constant = known.value;
        }
    }
    return tape;
unsuited:
    Py_DECREF(tape);
    if (PyErr_Occurred()) return NULL;
    Py_RETURN_NONE;
}

/* The operands of an operator, in its order. */
static inline void operands(const Entry *entry, const double *numbers, double *a, double *b)
{
    int side = SIDE_OF(entry->kind - OF_OPERATOR);
    *a = side == RIGHT ? entry->constant : numbers[entry->first];
    *b = side == RIGHT ? numbers[entry->first] : side == LEFT ? entry->constant : numbers[entry->second];
}

/* The values of some nodes as doubles, to be freed with PyMem_Free; those that are no numbers are not looked at. */
static double *as_doubles(PyObject *values)
{
    Py_ssize_t size = PyList_GET_SIZE(values);
    double *numbers = PyMem_Malloc(((size_t)size + 1) * sizeof(double));
    if (numbers == NULL) return (double *)PyErr_NoMemory();
    for (Py_ssize_t at = 0; at < size; at++) {
        if (!as_double(PyList_GET_ITEM(values, at), numbers + at)) numbers[at] = NAN;
    }
    return numbers;
}

PyObject *run_tape(PyObject *module, PyObject *args)
{
    PyObject *tape, *values;
    if (!PyArg_ParseTuple(args, "SO!:run_tape", &tape, &PyList_Type, &values)) return NULL;
    const Entry *entries = (const Entry *)PyBytes_AS_STRING(tape);
    Py_ssize_t size = PyBytes_GET_SIZE(tape) / (Py_ssize_t)sizeof(Entry);
    double *numbers = as_doubles(values);
    if (numbers == NULL) return NULL;
    for (Py_ssize_t at = 0; at < size && at < PyList_GET_SIZE(values); at++) {
        const Entry *entry = entries + at;
        if (entry->kind == STILL) continue;
        double a, b, *result = numbers + at;
        if (entry->kind >= OF_OPERATOR) {
            operands(entry, numbers, &a, &b);
            if (!compute_floats(OPERATOR_OF(entry->kind - OF_OPERATOR), a, b, result)) {
                PyErr_SetString(PyExc_ZeroDivisionError, "float division by zero");
                goto failed;
            }
        } else if (entry->kind == NEGATIVE) {
            *result = -numbers[entry->first];
        } else {
            a = numbers[entry->first];
            if (isinf(a)) {
                PyErr_SetString(PyExc_ValueError, "math domain error");
                goto failed;
            }
            *result = entry->kind == SINE ? sin(a) : cos(a);
        }
        PyObject *number = PyFloat_FromDouble(*result);
        if (number == NULL || PyList_SetItem(values, at, number) < 0) goto failed;
    }
    PyMem_Free(numbers);
    Py_RETURN_NONE;
failed:
    PyMem_Free(numbers);
    return NULL;
}

/* The slopes of an entry for its operands, 0 if they are not finite. */
static Slopes slopes_of(const Entry *entry, const double *numbers)
{
    Slopes slopes = {0.0, 0.0};
    double a, b, one = 1.0, other = 1.0;
    switch (entry->kind) {
    case STILL:
        return slopes;
    case NEGATIVE:
        one = -1.0;
        break;
    case SINE:
        one = cos(numbers[entry->first]);
        break;
    case COSINE:
        one = -sin(numbers[entry->first]);
        break;
    default:
        operands(entry, numbers, &a, &b);
        switch (OPERATOR_OF(entry->kind - OF_OPERATOR)) {
        case SUBTRACT:
            other = -1.0;
            break;
        case MULTIPLY:
            one = b;
            other = a;
            break;
        case DIVIDE:
            one = 1.0 / b;
            other = -a / b / b;
            break;
        }
        if (SIDE_OF(entry->kind - OF_OPERATOR) == RIGHT) one = other;
        if (SIDE_OF(entry->kind - OF_OPERATOR) == BOTH && isfinite(other)) slopes.second = other;
    }
    if (isfinite(one)) slopes.first = one;
    return slopes;
}

/* Add the slopes of all nodes for those at some places, by one sweep forwards. */
static void rise(const Entry *entries, const Slopes *slopes, Py_ssize_t size, double *rises)
{
    for (Py_ssize_t at = 0; at < size; at++) {
        if (entries[at].kind == STILL) continue;
        double total = 0.0, first = rises[entries[at].first], second = rises[entries[at].second];
        if (slopes[at].first != 0.0 && first != 0.0) total += slopes[at].first * first;
        if (slopes[at].second != 0.0 && second != 0.0) total += slopes[at].second * second;
        rises[at] = total;
    }
}

PyObject *tape_slopes(PyObject *module, PyObject *args)
{
    PyObject *tape, *values, *sources, *roots, *below, *result = NULL;
    if (!PyArg_ParseTuple(args, "SO!O!O!O:tape_slopes", &tape, &PyList_Type, &values, &PyList_Type, &sources, &PyList_Type,
                          &roots, &below)) {
        return NULL;
    }
    const Entry *entries = (const Entry *)PyBytes_AS_STRING(tape);
    Py_ssize_t size = PyBytes_GET_SIZE(tape) / (Py_ssize_t)sizeof(Entry), count = PyList_GET_SIZE(sources);
    double *numbers = as_doubles(values);
    double *changes = PyMem_Malloc(((size_t)size + 1) * sizeof(double));
    Slopes *slopes = PyMem_Malloc(((size_t)size + 1) * sizeof(Slopes));
    if (changes == NULL || slopes == NULL) PyErr_NoMemory();
    if (numbers == NULL || changes == NULL || slopes == NULL) goto done;
    for (Py_ssize_t at = 0; at < size; at++) slopes[at] = slopes_of(entries + at, numbers);
    int is_forwards = below == Py_None;
    result = PyList_New(0);
    for (Py_ssize_t row = 0; result != NULL && row < (is_forwards ? count : PyList_GET_SIZE(roots)); row++) {
        memset(changes, 0, (size_t)size * sizeof(double));
        if (is_forwards) {
            PyObject *places = PyList_GET_ITEM(sources, row);
            for (Py_ssize_t at = 0; at < PyList_GET_SIZE(places); at++) {
                changes[PyLong_AsLong(PyList_GET_ITEM(places, at))] = 1.0;
            }
            rise(entries, slopes, size, changes);
        } else {
            PyObject *places = PyList_GET_ITEM(below, row);
            changes[PyLong_AsLong(PyList_GET_ITEM(roots, row))] = 1.0;
            for (Py_ssize_t at = 0; at < PyList_GET_SIZE(places); at++) {
                long place = PyLong_AsLong(PyList_GET_ITEM(places, at));
                double weight = changes[place];
                if (entries[place].kind == STILL || weight == 0.0) continue;
                if (slopes[place].first != 0.0) changes[entries[place].first] += weight * slopes[place].first;
                if (slopes[place].second != 0.0) changes[entries[place].second] += weight * slopes[place].second;
            }
        }
        Py_ssize_t width = is_forwards ? PyList_GET_SIZE(roots) : count;
        PyObject *line = PyList_New(width);
        for (Py_ssize_t column = 0; line != NULL && column < width; column++) {
            double slope = 0.0;
            if (is_forwards) {
                slope = changes[PyLong_AsLong(PyList_GET_ITEM(roots, column))];
            } else {
                PyObject *places = PyList_GET_ITEM(sources, column);
                for (Py_ssize_t at = PyList_GET_SIZE(places) - 1; at >= 0; at--) {
                    slope += changes[PyLong_AsLong(PyList_GET_ITEM(places, at))];
                }
            }
            PyObject *number = PyFloat_FromDouble(slope);
            if (number == NULL) Py_CLEAR(line);
            else PyList_SET_ITEM(line, column, number);
        }
        if (line == NULL || PyList_Append(result, line) < 0) Py_CLEAR(result);
        Py_XDECREF(line);
    }
done:
    PyMem_Free(numbers);
    PyMem_Free(changes);
    PyMem_Free(slopes);
    return result;
}
