/* What does the core offer to Python, and what is it told? */

#include "core.h"

#define INTERFACE 20 /* what `accelerator.py` asks for */

PyObject *forms[3 * OPERATORS], *fallbacks[OPERATORS], *negation, *source_form, *lazy_form, *shorten, *resolve,
    *new_other, *source_classes, *tracked_classes, *affine_form, *slopes_or_zeros, *absolute_form, *affine_of_python,
    *refill, *sine_form, *cosine_form;
int limit, max_shared_size;

PyObject *names[NAMES];
static const char *const texts[NAMES] = {
    [FORWARD] = "forward", [INVERSE] = "inverse", [SINGLE_OPERAND] = "single_operand", [OPERATION] = "operation",
    [OPERANDS] = "operands", [RECORD] = "_record", [AFFINE] = "affine", [VALUE] = "value", [NAME] = "name",
    [KEY] = "key", [GETTER] = "getter", [TRACKED] = "tracked",
};

/* Tell the core what it records and what it hands over. */
static PyObject *complete(PyObject *module, PyObject *args)
{
    PyObject *of_operators, *of_fallbacks, *told[15];
    if (!PyArg_ParseTuple(args, "O!O!OOOOOOO!O!OOOOOOOii:complete", &PyTuple_Type, &of_operators, &PyTuple_Type,
                          &of_fallbacks, &told[0], &told[1], &told[2], &told[3], &told[4], &told[5], &PyTuple_Type,
                          &told[6], &PySet_Type, &told[7], &told[8], &told[9], &told[10], &told[11],
                          &told[12], &told[13], &told[14], &limit, &max_shared_size)) {
        return NULL;
    }
    if (PyTuple_GET_SIZE(of_operators) != 3 * OPERATORS || PyTuple_GET_SIZE(of_fallbacks) != OPERATORS) {
        return PyErr_Format(PyExc_ValueError, "three forms and a fallback of each operator");
    }
    PyObject **places[] = {&negation,  &source_form,    &lazy_form,       &shorten,     &resolve,
                           &new_other, &source_classes, &tracked_classes, &affine_form, &slopes_or_zeros,
                           &absolute_form, &affine_of_python, &refill,
                           &sine_form, &cosine_form};
    for (int at = 0; at < 3 * OPERATORS; at++) {
        Py_XSETREF(forms[at], Py_NewRef(PyTuple_GET_ITEM(of_operators, at)));
    }
    for (int at = 0; at < OPERATORS; at++) {
        Py_XSETREF(fallbacks[at], Py_NewRef(PyTuple_GET_ITEM(of_fallbacks, at)));
    }
    for (int at = 0; at < 15; at++) Py_XSETREF(*places[at], Py_NewRef(told[at]));
    Py_RETURN_NONE;
}

static PyMethodDef functions[] = {
    {"complete", complete, METH_VARARGS, "Tell the core what it records and what it hands over; once, before all."},
    {"new", (PyCFunction)(void (*)(void))new_value, METH_FASTCALL, "new(value, record, size): a tracked float or int."},
    {"lazy_of", (PyCFunction)(void (*)(void))lazy_of, METH_FASTCALL, "lazy_of(values, load): as in tracked.py."},
    {"allow", allow, METH_O, "allow(count): so many operations may be recorded from now on; returns what was left."},
    {"spend", spend, METH_O, "spend(count): as in recording.py."},
    {"exchange", exchange, METH_O, "exchange([(owner, key, expected, value), ...]): as in slots.py."},
    {"along_chain", (PyCFunction)(void (*)(void))along_chain, METH_FASTCALL,
     "along_chain(value, {Source: value}): the value of a chain on one source, or NotImplemented."},
    {"solve_chain", (PyCFunction)(void (*)(void))solve_chain, METH_FASTCALL,
     "solve_chain(value, target, relative): {Source: value}, None without an answer, or NotImplemented."},
    {"add_nodes", add_nodes, METH_VARARGS, "add_nodes(root, nodes, records, index, occurrences): as Graph does."},
    {"swept", swept, METH_O, "swept([value, ...]): `_swept` of each as in affine.py, or NotImplemented."},
    {"resized", resized, METH_VARARGS, "resized(value, bound): `_resized` as in affine.py, or NotImplemented."},
    {"tape", make_tape, METH_VARARGS,
     "tape(steps, records, values): what `run_tape` needs, or None if an operation is none of floats that it knows."},
    {"run_tape", run_tape, METH_VARARGS, "run_tape(tape, values): as `Graph.run` does."},
    {"tape_slopes", tape_slopes, METH_VARARGS,
     "tape_slopes(tape, values, places of each source, roots, unit of each, `Graph.below` of each or None): as "
     "`Equations._jacobian` does; by sweeps forwards without `below`."},
    {"shortest_step", shortest_step, METH_VARARGS, "shortest_step(rows, missing, scales, damping, by_row): as in\n"
     "least_squares.py, or NotImplemented."},
    {"affine", affine_terms, METH_O, "affine(value): as in affine.py."},
    {"recorder", make_recorder, METH_VARARGS,
     "recorder(forward, (left, right, both), arity, otherwise, name, doc): as in functions.py."},
    {"keeping", make_keeper, METH_VARARGS, "keeping(of_plain, of_tracked, name, doc): as in functions.py."},
    {"reflecting", make_reflector, METH_VARARGS, "reflecting(plain, reflected, kinds, name, doc): as in functions.py."},
    {"stripper", make_stripper, METH_VARARGS, "stripper(otherwise, name, doc): as in functions.py."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "rosslt._core",
    .m_doc = "The compiled core of rosslt.values.",
    .m_size = -1,
    .m_methods = functions,
};

PyMODINIT_FUNC PyInit__core(void)
{
    for (int at = 0; at < NAMES; at++) {
        names[at] = PyUnicode_InternFromString(texts[at]);
        if (names[at] == NULL) return NULL;
    }
    PyObject *module = PyModule_Create(&definition);
    if (module == NULL) return NULL;
    if (add_classes(module) < 0 || PyModule_AddIntConstant(module, "INTERFACE", INTERFACE) < 0) Py_CLEAR(module);
    return module;
}
