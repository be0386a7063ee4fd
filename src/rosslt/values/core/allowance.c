/* How many operations may still be recorded (`recording.py`)? */

#include "core.h"

long long allowance = LLONG_MAX;

PyObject *allow(PyObject *module, PyObject *count)
{
    long long number = PyLong_AsLongLong(count);
    if (number == -1 && PyErr_Occurred()) return NULL;
    long long left = allowance;
    allowance = number;
    return PyLong_FromLongLong(left);
}

int refilled(long long overdrawn)
{
    if (allowance == 0) return 0;
    allowance = LLONG_MAX; /* what refilling does is not counted */
    PyObject *given = PyObject_CallFunction(refill, "L", overdrawn);
    long long number = given == NULL ? -1 : PyLong_AsLongLong(given);
    Py_XDECREF(given);
    if (number == -1 && PyErr_Occurred()) return -1;
    allowance = number;
    return number > 0;
}

PyObject *spend(PyObject *module, PyObject *count)
{
    long long number = PyLong_AsLongLong(count);
    int may_record = number == -1 && PyErr_Occurred() ? -1 : allowance > 0;
    if (may_record > 0 && number >= allowance) may_record = refilled(number - allowance);
    else if (may_record > 0) allowance -= number;
    return may_record < 0 ? NULL : PyBool_FromLong(may_record);
}
