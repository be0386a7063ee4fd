/* What are the values of a graph's nodes if some have changed, and what are the slopes? `Graph.run`, `partials`,
   `tangent` and `gradient` of `graph.py`, on doubles, for the operations that positions and angles are made of: a tape has an
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

/* Put a slope that is not 0 into a row: -1 with an error. */
static int put_slope(PyObject *row, Py_ssize_t column, double slope)
{
    if (slope == 0.0) return 0;
    if (!isfinite(slope)) {
        PyErr_SetString(PyExc_OverflowError, "a slope that no float holds");
        return -1;
    }
    PyObject *key = PyLong_FromSsize_t(column), *number = PyFloat_FromDouble(slope);
    int status = key == NULL || number == NULL ? -1 : PyDict_SetItem(row, key, number);
    Py_XDECREF(key);
    Py_XDECREF(number);
    return status;
}

/* Sweep forwards for each source, and put the slopes of all roots into their rows: -1 with an error. */
static int put_columns(const Entry *entries, const Slopes *slopes, Py_ssize_t size, double *rises, PyObject *sources,
                       PyObject *roots, const double *units, PyObject *rows)
{
    for (Py_ssize_t column = 0; column < PyList_GET_SIZE(sources); column++) {
        PyObject *places = PyList_GET_ITEM(sources, column);
        memset(rises, 0, (size_t)size * sizeof(double));
        for (Py_ssize_t at = 0; at < PyList_GET_SIZE(places); at++) {
            rises[PyLong_AsLong(PyList_GET_ITEM(places, at))] = 1.0;
        }
        rise(entries, slopes, size, rises);
        for (Py_ssize_t row = 0; row < PyList_GET_SIZE(roots); row++) {
            double slope = rises[PyLong_AsLong(PyList_GET_ITEM(roots, row))];
            if (put_slope(PyList_GET_ITEM(rows, row), column, slope * units[row]) < 0) return -1;
        }
    }
    return 0;
}

/* Sweep backwards from a root, and put its slopes for all sources into its row: -1 with an error. */
static int put_row(const Entry *entries, const Slopes *slopes, Py_ssize_t size, double *weights, PyObject *sources,
                   long root, PyObject *below, double unit, PyObject *row)
{
    memset(weights, 0, (size_t)size * sizeof(double));
    weights[root] = 1.0;
    for (Py_ssize_t at = 0; at < PyList_GET_SIZE(below); at++) {
        long place = PyLong_AsLong(PyList_GET_ITEM(below, at));
        double weight = weights[place];
        if (entries[place].kind == STILL || weight == 0.0) continue;
        if (slopes[place].first != 0.0) weights[entries[place].first] += weight * slopes[place].first;
        if (slopes[place].second != 0.0) weights[entries[place].second] += weight * slopes[place].second;
    }
    for (Py_ssize_t column = 0; column < PyList_GET_SIZE(sources); column++) {
        PyObject *places = PyList_GET_ITEM(sources, column);
        double slope = 0.0;
        for (Py_ssize_t at = PyList_GET_SIZE(places) - 1; at >= 0; at--) {
            slope += weights[PyLong_AsLong(PyList_GET_ITEM(places, at))];
        }
        if (put_slope(row, column, slope * unit) < 0) return -1;
    }
    return 0;
}

PyObject *tape_slopes(PyObject *module, PyObject *args)
{
    PyObject *tape, *values, *sources, *roots, *of_units, *below, *rows = NULL;
    if (!PyArg_ParseTuple(args, "SO!O!O!O!O:tape_slopes", &tape, &PyList_Type, &values, &PyList_Type, &sources,
                          &PyList_Type, &roots, &PyList_Type, &of_units, &below)) {
        return NULL;
    }
    const Entry *entries = (const Entry *)PyBytes_AS_STRING(tape);
    Py_ssize_t size = PyBytes_GET_SIZE(tape) / (Py_ssize_t)sizeof(Entry), height = PyList_GET_SIZE(roots);
    double *numbers = as_doubles(values), *units = as_doubles(of_units);
    double *changes = PyMem_Malloc(((size_t)size + 1) * sizeof(double));
    Slopes *slopes = PyMem_Malloc(((size_t)size + 1) * sizeof(Slopes));
    if (changes == NULL || slopes == NULL) PyErr_NoMemory();
    if (numbers == NULL || units == NULL || changes == NULL || slopes == NULL) goto done;
    for (Py_ssize_t at = 0; at < size; at++) slopes[at] = slopes_of(entries + at, numbers);
    rows = PyList_New(0);
    for (Py_ssize_t at = 0; rows != NULL && at < height; at++) {
        PyObject *row = PyDict_New();
        if (row == NULL || PyList_Append(rows, row) < 0 ||
            (below != Py_None &&
             put_row(entries, slopes, size, changes, sources, PyLong_AsLong(PyList_GET_ITEM(roots, at)),
                     PyList_GET_ITEM(below, at), units[at], row) < 0)) {
            Py_CLEAR(rows);
        }
        Py_XDECREF(row);
    }
    if (rows != NULL && below == Py_None &&
        put_columns(entries, slopes, size, changes, sources, roots, units, rows) < 0) {
        Py_CLEAR(rows);
    }
done:
    PyMem_Free(numbers);
    PyMem_Free(units);
    PyMem_Free(changes);
    PyMem_Free(slopes);
    return rows;
}
