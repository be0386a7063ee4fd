/* Which of the tracked fields of a message are others than before? `replaced_fields` of `fields.py`. */

#include "core.h"

enum { INDEX, FIELD_VALUE, KIND_OF_FIELD, PARTS };

#define IS_FIELD(x) (PyTuple_CheckExact(x) && PyTuple_GET_SIZE(x) == PARTS)
#define PART(field, part) PyTuple_GET_ITEM(field, part)

/* Whether a field of an earlier message is that of a value at an index: -1 with an error. */
static int is_field_of(PyObject *field, PyObject *value, Py_ssize_t index)
{
    if (!IS_FIELD(field) || PART(field, FIELD_VALUE) != value || !PyLong_CheckExact(PART(field, INDEX))) return 0;
    Py_ssize_t known = PyLong_AsSsize_t(PART(field, INDEX));
    return known == -1 && PyErr_Occurred() ? -1 : known == index;
}

int append_field(PyObject *found, PyObject *before, Py_ssize_t index, PyObject *value, PyObject *kind)
{
    Py_ssize_t at = PyList_GET_SIZE(found);
    Py_ssize_t known = before == NULL ? 0 : PySequence_Fast_GET_SIZE(before);
    PyObject *earlier = at < known ? PySequence_Fast_GET_ITEM(before, at) : NULL;
    int is_known = earlier == NULL ? 0 : is_field_of(earlier, value, index);
    if (is_known != 0) return is_known > 0 && PyList_Append(found, earlier) == 0;
    PyObject *number = PyLong_FromSsize_t(index);
    PyObject *field = number == NULL ? NULL : PyTuple_Pack(PARTS, number, value, kind);
    int is_done = field != NULL && PyList_Append(found, field) == 0;
    Py_XDECREF(number);
    Py_XDECREF(field);
    return is_done;
}

/* Whether two texts or ints are the same: -1 with an error. */
static inline int is_same(PyObject *one, PyObject *other)
{
    return one == other ? 1 : PyObject_RichCompareBool(one, other, Py_EQ);
}

/* Whether two fields are the same one, whatever their values are: -1 with an error. */
static int is_same_field(PyObject *one, PyObject *other)
{
    if (!IS_FIELD(one) || !IS_FIELD(other)) {
        PyErr_SetString(PyExc_TypeError, "a field is a tuple (index, value, kind)");
        return -1;
    }
    int status = is_same(PART(one, INDEX), PART(other, INDEX));
    return status == 1 ? is_same(PART(one, KIND_OF_FIELD), PART(other, KIND_OF_FIELD)) : status;
}

/* As in fields.py. */
PyObject *replaced_fields(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 2 || !PyList_CheckExact(args[0]) || !PyList_CheckExact(args[1])) {
        return PyErr_Format(PyExc_TypeError, "replaced_fields(list found, list before)");
    }
    if (PyList_GET_SIZE(args[0]) != PyList_GET_SIZE(args[1])) Py_RETURN_NONE;
    PyObject *places = PyList_New(0);
    int status = 1;
    for (Py_ssize_t at = 0; places != NULL && status == 1 && at < PyList_GET_SIZE(args[0]); at++) {
        PyObject *field = PyList_GET_ITEM(args[0], at), *earlier = PyList_GET_ITEM(args[1], at);
        if (field == earlier) continue;
        status = is_same_field(field, earlier);
        if (status != 1 || PART(field, FIELD_VALUE) == PART(earlier, FIELD_VALUE)) continue;
        PyObject *place = PyLong_FromSsize_t(at);
        if (place == NULL || PyList_Append(places, place) < 0) status = -1;
        Py_XDECREF(place);
    }
    if (status == 0) Py_XSETREF(places, Py_NewRef(Py_None));
    if (status < 0) Py_CLEAR(places);
    return places;
}
