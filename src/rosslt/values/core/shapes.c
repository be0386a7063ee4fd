/* What are affine fields of a message made of, apart from their floats? `shape_of` of `templates.py`, of the fields
   as they are found: a node that sends what moves asks it of each message. */

#include "core.h"

enum { MOST_NUMBERS = 128 };

/* What was found so far. */
typedef struct {
    PyObject *key, *leaves[MOST_NUMBERS];
    double slopes[MOST_NUMBERS], small;
    int leaf_count, slope_count;
} Shape;

static int add(Shape *shape, PyObject *part)
{
    int status = part == NULL ? -1 : PyList_Append(shape->key, part);
    Py_XDECREF(part);
    return status < 0 ? TERMS_FAILED : TERMS_FOUND;
}

static int add_number(Shape *shape, Py_ssize_t number)
{
    return add(shape, PyLong_FromSsize_t(number));
}

static inline int is_same_bits(double one, double other)
{
    return memcmp(&one, &other, sizeof one) == 0;
}

/* Add a source with its value: the source where they come up for the first time, else their number. */
static int add_reading(Shape *shape, PyObject *leaf)
{
    if (!IS_FLOAT(leaf)) return TERMS_OF_PYTHON;
    PyObject *source = record_of(leaf)->first;
    for (int at = shape->leaf_count - 1; at >= 0; at--) {
        PyObject *known = shape->leaves[at];
        int is_same = is_same_source(record_of(known)->first, source);
        if (is_same < 0) return TERMS_FAILED;
        if (is_same == UNKNOWN_SOURCE) return TERMS_OF_PYTHON;
        if (is_same && is_same_bits(PyFloat_AS_DOUBLE(known), PyFloat_AS_DOUBLE(leaf))) return add_number(shape, at);
    }
    if (shape->leaf_count == MOST_NUMBERS) return TERMS_OF_PYTHON;
    shape->leaves[shape->leaf_count++] = Py_NewRef(leaf);
    return add(shape, Py_NewRef(source));
}

/* Add a coefficient: what is sent as an integer itself, anything else by its number. */
static int add_slope(Shape *shape, Slope slope)
{
    double value = slope.value;
    if (slope.is_whole) {
        int status = add(shape, Py_NewRef(Py_None));
        return status == TERMS_FOUND ? add(shape, PyLong_FromDouble(value)) : status;
    }
    if (value == 0.0) return TERMS_OF_PYTHON;
    if (value == floor(value) && fabs(value) < shape->small) {
        int status = add(shape, Py_NewRef(Py_Ellipsis));
        return status == TERMS_FOUND ? add(shape, PyFloat_FromDouble(value)) : status;
    }
    int at = 0;
    while (at < shape->slope_count && shape->slopes[at] != value) at++;
    if (at == MOST_NUMBERS) return TERMS_OF_PYTHON;
    if (at == shape->slope_count) shape->slopes[shape->slope_count++] = value;
    return add_number(shape, at);
}

/* Add a field `(index, value, kind)`. */
static int add_field(Shape *shape, PyObject *field)
{
    if (!PyTuple_CheckExact(field) || PyTuple_GET_SIZE(field) != 3) return TERMS_OF_PYTHON;
    PyObject *value = PyTuple_GET_ITEM(field, 1), *kind = PyTuple_GET_ITEM(field, 2);
    int is_of_floats = PyUnicode_CompareWithASCIIString(kind, "d") == 0 ||
                       PyUnicode_CompareWithASCIIString(kind, "f") == 0;
    Terms terms;
    int status = is_of_floats && IS_FLOAT(value) ? find_terms(&terms, value) : TERMS_OF_PYTHON;
    if (status != TERMS_FOUND) return status;
    if (terms.term_count == 0) return TERMS_OF_PYTHON; /* what was found to have no provenance is not sent */
    status = add(shape, Py_NewRef(PyTuple_GET_ITEM(field, 0)));
    if (status == TERMS_FOUND && terms.term_count == 1 && terms.terms[0].slope.value == 1.0 &&
        IS_FLOAT(terms.terms[0].leaf)) {
        double at = PyFloat_AS_DOUBLE(terms.terms[0].leaf), of_field = PyFloat_AS_DOUBLE(value);
        if (at == of_field || (at != at && of_field != of_field)) {
            return add(shape, Py_NewRef(record_of(terms.terms[0].leaf)->first));
        }
    }
    if (status == TERMS_FOUND) status = add_number(shape, terms.term_count);
    for (int at = 0; status == TERMS_FOUND && at < terms.term_count; at++) {
        status = add_reading(shape, terms.terms[at].leaf);
        if (status == TERMS_FOUND) status = add_slope(shape, terms.terms[at].slope);
    }
    return status;
}

/* The floats of a shape in lists; NULL with an error, or without where they are not finite. */
static PyObject *floats_of(const Shape *shape, PyObject *key)
{
    double total = 0.0;
    PyObject *values = PyList_New(shape->leaf_count), *slopes = PyList_New(shape->slope_count), *answer = NULL;
    for (int at = 0; values != NULL && at < shape->leaf_count; at++) {
        PyObject *plain = plain_of(shape->leaves[at]);
        if (plain == NULL) Py_CLEAR(values);
        else PyList_SET_ITEM(values, at, plain);
        total += PyFloat_AS_DOUBLE(shape->leaves[at]);
    }
    for (int at = 0; slopes != NULL && at < shape->slope_count; at++) {
        PyObject *slope = PyFloat_FromDouble(shape->slopes[at]);
        if (slope == NULL) Py_CLEAR(slopes);
        else PyList_SET_ITEM(slopes, at, slope);
        total += shape->slopes[at];
    }
    if (values != NULL && slopes != NULL && isfinite(total)) answer = PyTuple_Pack(3, key, values, slopes);
    Py_XDECREF(values);
    Py_XDECREF(slopes);
    return answer;
}

/* As `affine_shape` in affine.py. */
PyObject *affine_shape(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (count != 2 || !PyList_CheckExact(args[0])) {
        return PyErr_Format(PyExc_TypeError, "affine_shape(list of fields, small)");
    }
    Shape shape;
    shape.leaf_count = shape.slope_count = 0;
    shape.small = PyFloat_AsDouble(args[1]);
    shape.key = PyErr_Occurred() ? NULL : PyList_New(0);
    int status = shape.key == NULL ? TERMS_FAILED : TERMS_FOUND;
    for (Py_ssize_t at = 0; status == TERMS_FOUND && at < PyList_GET_SIZE(args[0]); at++) {
        status = add_field(&shape, PyList_GET_ITEM(args[0], at));
    }
    PyObject *key = status == TERMS_FOUND ? PyList_AsTuple(shape.key) : NULL;
    PyObject *answer = key == NULL ? NULL : floats_of(&shape, key);
    for (int at = 0; at < shape.leaf_count; at++) Py_DECREF(shape.leaves[at]);
    Py_XDECREF(shape.key);
    Py_XDECREF(key);
    if (answer == NULL && !PyErr_Occurred()) Py_RETURN_NONE;
    return answer;
}
