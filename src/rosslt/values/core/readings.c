/* What does a call from this place in a program read? `rosslt.location` asks; `reading` in `accelerator.py`. */

#include "core.h"
#if PY_VERSION_HEX < 0x030B0000
#include <frameobject.h>
#endif

#if PY_VERSION_HEX < 0x03090000
#define PyObject_Vectorcall _PyObject_Vectorcall
#endif

/* Where the Python code that runs calls something, with the name and the key that it gives: what `known` has the calls
   by (`Locations.by_call`). */
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
        if (word == names[NAME]) {
            name = given;
        } else if (word == names[KEY]) {
            key = given;
        } else if (word == names[VALUE]) {
            value = given;
        } else if (word == names[GETTER] || !PyUnicode_CHECK_INTERNED(word)) {
            value = Py_None;
            break;
        }
    }
    if (value != Py_None) {
        PyObject *place = place_of_call(name, key);
        PyObject *found = place ? PyDict_GetItemWithError(PyTuple_GET_ITEM(self, 1), place) : NULL, *read = NULL;
        Py_XINCREF(found);
        Py_XDECREF(place);
        if (found != NULL) read = PyObject_GetAttr(found, names[TRACKED]);
        Py_XDECREF(found);
        if (read != NULL || PyErr_Occurred()) return read;
    }
    return PyObject_Vectorcall(PyTuple_GET_ITEM(self, 0), args, (size_t)count, words);
}

/* As `reading` in accelerator.py. What it makes is there as long as the process. */
PyObject *reading(PyObject *module, PyObject *args)
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
