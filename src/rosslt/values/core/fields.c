/* Which fields of a message are tracked, and are they made as those of the last one? A node that sends what moves asks
   it of each message. `select_tracked` and `is_made_alike` of `tracked.py`. */

#include "core.h"

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
PyObject *made_alike(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 2) return PyErr_Format(PyExc_TypeError, "made_alike(value, other)");
    int pairs = 256;
    return PyBool_FromLong(show_alike(args[0], args[1], &pairs));
}

/* As `select_tracked` in tracked.py. */
PyObject *select_tracked(PyObject *module, PyObject *args)
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
