/* Where does Python keep a value, and how is it exchanged for another one at one moment (`slots.py`)? */

#include "core.h"
#include <frameobject.h>

/* What a slot holds: a new reference; NULL with or without an error if it holds nothing. */
static PyObject *held(PyObject *owner, PyObject *key)
{
    if (PyCell_Check(owner)) return PyCell_Get(owner);
    if (PyFrame_Check(owner)) {
        PyObject *locals = PyObject_GetAttrString(owner, "f_locals");
        PyObject *value = locals == NULL ? NULL : PyObject_GetItem(locals, key);
        Py_XDECREF(locals);
        return value;
    }
    if (PyDict_Check(owner) || PyType_Check(owner)) {
        PyObject *value = PyDict_GetItemWithError(PyDict_Check(owner) ? owner : ((PyTypeObject *)owner)->tp_dict, key);
        Py_XINCREF(value);
        return value;
    }
    if (PyUnicode_Check(key)) return PyObject_GenericGetAttr(owner, key);
    return PyObject_GetItem(owner, key);
}

static int put(PyObject *owner, PyObject *key, PyObject *value, PyObject *dropped)
{
    if (PyCell_Check(owner)) return PyCell_Set(owner, value);
    if (PyFrame_Check(owner)) {
        PyObject *locals = PyObject_GetAttrString(owner, "f_locals");
        int status = locals == NULL ? -1 : PyObject_SetItem(locals, key, value);
        if (status == 0) PyFrame_LocalsToFast((PyFrameObject *)owner, 0);
        /* The frame would keep this snapshot, and drop what is in it when it is made the next time: in the middle of the
           next exchange, where nothing may be run. Nobody else has it if the frame and this function alone refer to it. */
        if (locals != NULL && Py_REFCNT(locals) == 2) {
            PyObject *kept = PyDict_Check(locals) ? PyDict_Copy(locals) : NULL;
            if (kept != NULL && PyList_Append(dropped, kept) == 0) PyDict_Clear(locals);
            Py_XDECREF(kept);
        }
        Py_XDECREF(locals);
        return status;
    }
    if (PyDict_Check(owner)) return PyDict_SetItem(owner, key, value);
    if (PyType_Check(owner)) return PyType_Type.tp_setattro(owner, key, value);
    if (PyUnicode_Check(key)) return PyObject_GenericSetAttr(owner, key, value);
    return PyObject_SetItem(owner, key, value);
}

/* Put other elements into a list or deque, given by the ids of those before, wherever these stand: whether any did. */
static int put_elements(PyObject *owner, PyObject *others)
{
    PyTypeObject *type = Py_TYPE(owner); /* the built-in one: a class of the program may have methods of its own */
    while (type->tp_flags & Py_TPFLAGS_HEAPTYPE) type = type->tp_base;
    PySequenceMethods *of = type->tp_as_sequence;
    if (of == NULL || of->sq_item == NULL || of->sq_ass_item == NULL) return 0;
    int is_done = 0;
    for (Py_ssize_t at = 0; at < of->sq_length(owner); at++) {
        PyObject *element = of->sq_item(owner, at), *id = PyLong_FromVoidPtr(element);
        PyObject *other = id == NULL ? NULL : PyDict_GetItemWithError(others, id);
        if (other != NULL && of->sq_ass_item(owner, at, other) == 0) is_done = 1;
        Py_XDECREF(element);
        Py_XDECREF(id);
    }
    return is_done;
}

/* No bytecode is run meanwhile, so no other thread sees some of the slots exchanged and others not. */
PyObject *exchange(PyObject *module, PyObject *rows)
{
    if (!PyList_Check(rows)) return PyErr_Format(PyExc_TypeError, "a list of slots");
    PyObject *done = PyList_New(0), *dropped = PyList_New(0);
    for (Py_ssize_t at = 0; done != NULL && dropped != NULL && at < PyList_GET_SIZE(rows); at++) {
        PyObject *owner, *key, *expected, *value;
        if (!PyArg_ParseTuple(PyList_GET_ITEM(rows, at), "OOOO", &owner, &key, &expected, &value)) {
            Py_CLEAR(done);
            break;
        }
        int is_done;
        if (key == Py_None && !PyCell_Check(owner) && !PyDict_Check(owner)) {
            is_done = PyDict_Check(value) && put_elements(owner, value);
        } else {
            PyObject *found = held(owner, key);
            is_done = found == expected && put(owner, key, value, dropped) == 0;
            Py_XDECREF(found);
        }
        PyErr_Clear(); /* a slot that is gone, or takes nothing */
        if (PyList_Append(done, is_done ? Py_True : Py_False) < 0) Py_CLEAR(done);
    }
    Py_XDECREF(dropped); /* what it holds may end now */
    return done;
}
