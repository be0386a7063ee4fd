/* What do functions of numbers record? Those of `math`, conversions, and what rewritten programs call in their inner loops
   (`functions.py`). Each is a function of the core that calls another one with whatever is not frequent. What they are
   made of is there as long as the process. */

#include "core.h"

#if PY_VERSION_HEX < 0x03090000
#define PyObject_Vectorcall _PyObject_Vectorcall
#endif

typedef PyObject *Call(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *words);

/* What a function is called with first: a module, as pickle knows the functions of modules alone. It keeps a pointer. */
static struct PyModuleDef kept = {PyModuleDef_HEAD_INIT, .m_name = "rosslt.values", .m_size = sizeof(void *)};
#define KEPT(self) (*(void **)PyModule_GetState(self))

/* A function that calls another one in the end, which gives it its module; `what` is kept for ever. */
static PyObject *made_function(Call *call, void *what, PyObject *otherwise, const char *name, const char *doc)
{
    PyObject *made = NULL, *self = PyModule_Create(&kept);
    PyMethodDef *definition = PyMem_Malloc(sizeof *definition);
    PyObject *home = self ? PyObject_GetAttrString(otherwise, "__module__") : NULL;
    if (definition == NULL) PyErr_NoMemory();
    if (definition != NULL && home != NULL) {
        KEPT(self) = what;
        *definition = (PyMethodDef){name, (PyCFunction)(void (*)(void))call, METH_FASTCALL | METH_KEYWORDS, doc};
        made = PyCFunction_NewEx(definition, self, home);
    }
    if (made == NULL) PyMem_Free(definition);
    Py_XDECREF(self);
    Py_XDECREF(home);
    return made;
}

/* --- operations on one or two numbers -------------------------------------------------------------------------- */

typedef struct {
    PyObject *forward, *otherwise, *of_sides[3]; /* the forms with the left, the right or both operands tracked */
    int kinds[3], arity;
} Recorder;

/* What an operation gives for numbers of which one is tracked; NULL without an error where Python has to do it. */
static PyObject *recorded(const Recorder *recorder, PyObject *const *args)
{
    int arity = recorder->arity, side = LEFT;
    PyObject *plains[2] = {plain_of(args[0]), arity == 2 ? plain_of(args[1]) : NULL}, *value = NULL, *result = NULL;
    if (plains[0] != NULL && (arity == 1 || plains[1] != NULL)) {
        value = PyObject_Vectorcall(recorder->forward, plains, (size_t)arity, NULL);
    }
    Py_XDECREF(plains[0]);
    Py_XDECREF(plains[1]);
    if (value == NULL) return NULL;
    if (PyFloat_CheckExact(value) || PyLong_CheckExact(value)) {
        if (arity == 2) side = IS_OURS(args[0]) ? IS_OURS(args[1]) ? BOTH : LEFT : RIGHT;
        PyObject *first = args[side == RIGHT], *second = arity == 1 ? Py_None : args[side != RIGHT];
        result = new_number(value, recorder->of_sides[side], first, second, recorder->kinds[side]);
    }
    Py_DECREF(value);
    return result;
}

static PyObject *call_recorder(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *words)
{
    const Recorder *recorder = KEPT(self);
    if (words == NULL && count == recorder->arity && (IS_OURS(args[0]) || (count == 2 && IS_OURS(args[1])))) {
        PyObject *result = recorded(recorder, args);
        if (result != NULL || PyErr_Occurred()) return result;
    }
    return PyObject_Vectorcall(recorder->otherwise, args, (size_t)count, words);
}

/* As `recorder` in functions.py. */
PyObject *make_recorder(PyObject *module, PyObject *args)
{
    PyObject *forward, *otherwise, *of_sides;
    const char *name, *doc;
    int arity;
    if (!PyArg_ParseTuple(args, "OO!iOss:recorder", &forward, &PyTuple_Type, &of_sides, &arity, &otherwise, &name,
                          &doc)) {
        return NULL;
    }
    if (arity < 1 || arity > 2 || PyTuple_GET_SIZE(of_sides) != 3) {
        return PyErr_Format(PyExc_ValueError, "one or two operands, and three forms");
    }
    Recorder *recorder = PyMem_Calloc(1, sizeof *recorder);
    if (recorder == NULL) return PyErr_NoMemory();
    recorder->arity = arity;
    for (int side = 0; side < (arity == 1 ? 1 : 3); side++) {
        recorder->of_sides[side] = PyTuple_GET_ITEM(of_sides, side);
        recorder->kinds[side] = kind_of(recorder->of_sides[side]);
        if (recorder->kinds[side] < 0) {
            PyMem_Free(recorder);
            return NULL;
        }
    }
    Py_INCREF(args); /* and all that it holds */
    recorder->forward = forward;
    recorder->otherwise = otherwise;
    return made_function(call_recorder, recorder, otherwise, name, doc);
}

/* --- plain numbers and others ---------------------------------------------------------------------------------- */

enum { OF_PLAIN, OF_TRACKED, OF_OTHERS, SORTS };

typedef struct {
    PyObject *called[SORTS];
} Keeper;

/* Which sort an argument is of: -1 with an error. */
static inline int sort_of(PyObject *x)
{
    if (PyFloat_CheckExact(x) || PyLong_CheckExact(x) || PyUnicode_Check(x)) return OF_PLAIN;
    if (IS_OURS(x) || PyList_Check(x) || PyTuple_Check(x)) return OF_TRACKED;
    int is_tracked = PySet_Contains(tracked_classes, (PyObject *)Py_TYPE(x));
    return is_tracked < 0 ? -1 : is_tracked ? OF_TRACKED : OF_OTHERS;
}

static PyObject *call_keeper(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *words)
{
    const Keeper *keeper = KEPT(self);
    int sort = OF_PLAIN;
    for (Py_ssize_t at = 0; sort != OF_OTHERS && at < count; at++) {
        int one = sort_of(args[at]);
        if (one < 0) return NULL;
        if (one > sort) sort = one;
    }
    return PyObject_Vectorcall(keeper->called[sort], args, (size_t)count, words);
}

/* A function that has three others, which the arguments of its maker begin with. */
static PyObject *made_of_three(PyObject *args, Call *call)
{
    PyObject *of_plain, *of_tracked, *of_others;
    const char *name, *doc;
    if (!PyArg_ParseTuple(args, "OOOss", &of_plain, &of_tracked, &of_others, &name, &doc)) return NULL;
    Keeper *keeper = PyMem_Malloc(sizeof *keeper);
    if (keeper == NULL) return PyErr_NoMemory();
    Py_INCREF(args);
    *keeper = (Keeper){{of_plain, of_tracked, of_others}};
    return made_function(call, keeper, of_plain, name, doc);
}

/* As `keeping` in functions.py. */
PyObject *make_keeper(PyObject *module, PyObject *args) { return made_of_three(args, call_keeper); }

static PyObject *call_reflector(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *words)
{
    const Keeper *reflector = KEPT(self);
    if (count == 2 && words == NULL && IS_OURS(args[1])) {
        PyObject *kinds = PyDict_GetItem(reflector->called[OF_OTHERS], (PyObject *)Py_TYPE(args[0]));
        int is_reflected = kinds == NULL ? 0 : PySequence_Contains(kinds, (PyObject *)Py_TYPE(args[1]));
        if (is_reflected < 0) return NULL;
        PyObject *result = is_reflected ? PyObject_Vectorcall(reflector->called[OF_TRACKED], args, 2, NULL) : NULL;
        if (result != Py_NotImplemented && (result != NULL || PyErr_Occurred())) return result;
        Py_XDECREF(result);
    }
    return PyObject_Vectorcall(reflector->called[OF_PLAIN], args, (size_t)count, words);
}

/* As `reflecting` in functions.py. */
PyObject *make_reflector(PyObject *module, PyObject *args) { return made_of_three(args, call_reflector); }

/* --- without provenance ---------------------------------------------------------------------------------------- */

static PyObject *call_stripper(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *words)
{
    if (words == NULL && count == 1) {
        PyObject *x = args[0], *plain = PyUnicode_CheckExact(x) ? Py_NewRef(x) : plain_of(x);
        if (plain != NULL || PyErr_Occurred()) return plain;
    }
    return PyObject_Vectorcall(KEPT(self), args, (size_t)count, words);
}

/* As `stripper` in functions.py. */
PyObject *make_stripper(PyObject *module, PyObject *args)
{
    PyObject *otherwise;
    const char *name, *doc;
    if (!PyArg_ParseTuple(args, "Oss:stripper", &otherwise, &name, &doc)) return NULL;
    Py_INCREF(args);
    return made_function(call_stripper, otherwise, otherwise, name, doc);
}
