/* Which nodes does any expression have, operands before their users? `Graph._add` of `graph.py`. */

#include "core.h"

/* Whether a node has its place in the index, by its key (a new reference, NULL without memory): -1 with an error. */
static int is_placed(PyObject *index, PyObject *node, PyObject **key)
{
    *key = PyLong_FromVoidPtr(node);
    return *key == NULL ? -1 : PyDict_Contains(index, *key);
}

/* Put those of some operands on the stack, the first on top, that have no place yet: how many, -1 with an error. */
static int push_missing(PyObject *stack, PyObject *index, PyObject *operands)
{
    int pushed = 0;
    for (Py_ssize_t at = PySequence_Fast_GET_SIZE(operands) - 1; at >= 0; at--) {
        PyObject *operand = PySequence_Fast_GET_ITEM(operands, at), *key;
        int is_there = is_placed(index, operand, &key);
        Py_XDECREF(key);
        if (is_there < 0 || (!is_there && PyList_Append(stack, operand) < 0)) return -1;
        pushed += !is_there;
    }
    return pushed;
}

/* Keep the place that a source's node gets: -1 with an error. */
static int keep_occurrence(PyObject *occurrences, PyObject *source, Py_ssize_t at)
{
    PyObject *places = PyDict_GetItemWithError(occurrences, source);
    Py_XINCREF(places);
    if (places == NULL && !PyErr_Occurred()) {
        places = PyList_New(0);
        if (places != NULL && PyDict_SetItem(occurrences, source, places) < 0) Py_CLEAR(places);
    }
    PyObject *place = places == NULL ? NULL : PyLong_FromSsize_t(at);
    int status = place == NULL ? -1 : PyList_Append(places, place);
    Py_XDECREF(places);
    Py_XDECREF(place);
    return status;
}

/* The operands of a record of this kind as a list or tuple; of a source none, and its place is kept. */
static PyObject *operands_of(PyObject *record, int kind, PyObject *nodes, PyObject *occurrences)
{
    PyObject *form = PyTuple_GET_ITEM(record, 0), *first = PyTuple_GET_ITEM(record, 1),
             *second = PyTuple_GET_ITEM(record, 2);
    if (IS_SINGLE(kind)) return PyTuple_Pack(1, first);
    if (kind != OTHER) return PyTuple_Pack(2, first, second);
    if (form == source_form) {
        return keep_occurrence(occurrences, first, PyList_GET_SIZE(nodes)) < 0 ? NULL : PyTuple_New(0);
    }
    PyObject *operands = PyObject_CallMethodObjArgs(form, names[OPERANDS], first, second, NULL);
    if (operands != NULL) Py_SETREF(operands, PySequence_Fast(operands, "operands are a sequence"));
    return operands;
}

/* Do what is on top of the stack: -1 with an error. */
static int visit_top(PyObject *stack, PyObject *nodes, PyObject *records, PyObject *index, PyObject *occurrences)
{
    Py_ssize_t top = PyList_GET_SIZE(stack) - 1;
    int kind = OTHER, status = -1, pushed = 0;
    PyObject *node = Py_NewRef(PyList_GET_ITEM(stack, top)), *record = NULL, *operands = NULL, *place = NULL, *key;
    int is_there = is_placed(index, node, &key);
    if (is_there < 0) goto done;
    if (!is_there) {
        record = resolved(node, &kind);
        operands = record == NULL ? NULL : operands_of(record, kind, nodes, occurrences);
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

PyObject *add_nodes(PyObject *module, PyObject *args)
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
