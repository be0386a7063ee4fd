/* Which leaves of a message are tracked, and for which of them does hold what was written of an earlier message? A walk
   knows the fields of a message class, as `field_walk` of `fields.py` says.

   A field is read from its slot, where the class has one, and else as an attribute. */

#include "core.h"
#include <structmember.h>

enum { VARIABLE = -1, SINGLE = -2 };

typedef struct Walk Walk;

typedef struct {
    PyObject *name;
    PyObject *kind;        /* of a scalar, or of the elements of an array of scalars; NULL for messages */
    Walk *walk;            /* of a message, or of the elements of an array of messages; NULL for scalars */
    Py_ssize_t length;     /* SINGLE, VARIABLE, or the number of elements */
    Py_ssize_t most;       /* the longest array in which a scalar may be tracked */
    Py_ssize_t offset;     /* of the slot in objects of the class that was met last; 0 where it has none */
} Member;

struct Walk {
    PyObject_VAR_HEAD
    vectorcallfunc vectorcall;
    PyObject *items_of;       /* as in walkers.py */
    PyTypeObject *met;        /* the class that was met last */
    Py_ssize_t leaf_count;    /* VARIABLE where it depends on the message */
    Member members[];
};

/* What was written of an earlier message, of each of its tracked leaves; and what comes of comparing a later one. */
typedef struct {
    const int32_t *indices;
    PyObject *values;
    const char *kinds, *moving;
    char *held;                    /* of each, what comes of it */
    Py_ssize_t count, at, tracked; /* at: the leaf that comes next; tracked: how many leaves of the message are */
} Written;

/* What a walk is for: to find leaves, or, where `found` is NULL, to compare them. */
typedef struct {
    PyObject *found, *before;
    Py_ssize_t limit;
    Written written;
} Task;

enum { FAILED = -1, DONE };

static int walk_message(Walk *walk, PyObject *message, Py_ssize_t *index, Task *task);

/* --- leaves ---------------------------------------------------------------------------------------------------- */

/* Whether a value is tracked: -1 with an error. */
static inline int is_tracked(PyObject *value)
{
    if (PyFloat_CheckExact(value) || PyLong_CheckExact(value) || PyUnicode_CheckExact(value)) return 0;
    return IS_OURS(value) ? 1 : PySet_Contains(tracked_classes, (PyObject *)Py_TYPE(value));
}

/* Whether two values are the same number or text, whatever they were made of: -1 with an error. */
static int is_same_plain(PyObject *one, PyObject *other)
{
    if (PyFloat_Check(one) && PyFloat_Check(other)) return PyFloat_AS_DOUBLE(one) == PyFloat_AS_DOUBLE(other);
    if (PyUnicode_Check(one) && PyUnicode_Check(other)) {
        int order = PyUnicode_Compare(one, other);
        return order == -1 && PyErr_Occurred() ? -1 : order == 0;
    }
    if (!PyLong_Check(one) || !PyLong_Check(other)) return 0;
    PyObject *answer = PyLong_Type.tp_richcompare(one, other, Py_EQ);
    Py_XDECREF(answer);
    return answer == NULL ? -1 : answer == Py_True;
}

/* Whether what was written of an earlier leaf holds for another tracked one: -1 with an error. */
static int holds(const Written *written, Py_ssize_t at, PyObject *value, PyObject *kind)
{
    PyObject *earlier = PyTuple_GET_ITEM(written->values, at);
    if ((Py_UCS4)written->kinds[at] != PyUnicode_READ_CHAR(kind, 0)) return 0;
    if (value == earlier) return 1;
    int status = written->moving[at] ? 1 : is_same_plain(value, earlier);
    return status == 1 ? is_made_alike(value, earlier) : status;
}

enum { HOLDS_NOT, HOLDS, IS_PLAIN };

/* What comes of a leaf that is plain and was tracked: -1 with an error. */
static int compare_plain(const Written *written, Py_ssize_t at, PyObject *value, PyObject *kind)
{
    if ((Py_UCS4)written->kinds[at] != PyUnicode_READ_CHAR(kind, 0)) return HOLDS_NOT;
    int status = written->moving[at] ? 1 : is_same_plain(value, PyTuple_GET_ITEM(written->values, at));
    return status == 1 ? IS_PLAIN : status;
}

static int compare_leaf(Written *written, PyObject *value, Py_ssize_t index, PyObject *kind)
{
    while (written->at < written->count && written->indices[written->at] < index) written->at++;
    int is_known = written->at < written->count && written->indices[written->at] == index;
    int is_same = is_known && value == PyTuple_GET_ITEM(written->values, written->at);
    int tracked = is_same ? 1 : is_tracked(value); /* what is the same one need not be looked at */
    if (tracked < 0) return FAILED;
    written->tracked += tracked;
    if (!is_known) return DONE;
    Py_ssize_t at = written->at++;
    int status = tracked ? holds(written, at, value, kind) : compare_plain(written, at, value, kind);
    if (status < 0) return FAILED;
    written->held[at] = (char)status;
    return DONE;
}

static int take_leaf(PyObject *value, Py_ssize_t index, PyObject *kind, Task *task)
{
    if (task->found == NULL) return compare_leaf(&task->written, value, index, kind);
    int tracked = is_tracked(value);
    if (tracked > 0) tracked = append_field(task->found, task->before, index, value, kind) ? 1 : -1;
    return tracked < 0 ? FAILED : DONE;
}

/* --- fields ---------------------------------------------------------------------------------------------------- */

/* Find out where objects of a class hold the fields. */
static void meet(Walk *walk, PyTypeObject *type)
{
    int is_usual = type->tp_getattro == PyObject_GenericGetAttr;
    for (Py_ssize_t at = 0; at < Py_SIZE(walk); at++) {
        Member *member = &walk->members[at];
        PyObject *descriptor = is_usual ? _PyType_Lookup(type, member->name) : NULL;
        member->offset = 0;
        if (descriptor == NULL || Py_TYPE(descriptor) != &PyMemberDescr_Type) continue;
        if (!PyType_IsSubtype(type, PyDescr_TYPE(descriptor))) continue; /* that of another class, which gives an error */
        const PyMemberDef *definition = ((PyMemberDescrObject *)descriptor)->d_member;
        if (definition->type == T_OBJECT_EX) member->offset = definition->offset;
    }
    Py_INCREF(type);
    Py_XSETREF(walk->met, type);
}

/* A field of a message, which is of the class that was met: a new reference, NULL with an error. */
static PyObject *field_of(PyObject *message, const Member *member, int has_slots)
{
    PyObject *value = has_slots && member->offset ? *(PyObject **)((char *)message + member->offset) : NULL;
    return value == NULL ? PyObject_GetAttr(message, member->name) : Py_NewRef(value);
}

static int walk_scalars(Walk *walk, const Member *member, PyObject *array, Py_ssize_t *index, Task *task)
{
    int has_size = member->length == VARIABLE || member->most < PY_SSIZE_T_MAX;
    Py_ssize_t start = *index, size = has_size ? PyObject_Size(array) : 0;
    if (size < 0) return FAILED;
    *index += member->length == VARIABLE ? size : member->length;
    if (PyBytes_CheckExact(array) || size > member->most) return DONE;
    int is_plain = PyList_CheckExact(array) || PyTuple_CheckExact(array);
    PyObject *items = is_plain ? Py_NewRef(array) : PyObject_CallFunctionObjArgs(walk->items_of, array, NULL);
    PyObject *elements = items == NULL ? NULL : PySequence_Fast(items, "an array is a sequence");
    Py_XDECREF(items);
    if (elements == NULL) return FAILED;
    int status = DONE;
    for (Py_ssize_t at = 0; status == DONE && at < PySequence_Fast_GET_SIZE(elements); at++) {
        PyObject *value = Py_NewRef(PySequence_Fast_GET_ITEM(elements, at));
        status = take_leaf(value, start + at, member->kind, task);
        Py_DECREF(value);
        if (task->found != NULL && PyList_GET_SIZE(task->found) > task->limit) break;
    }
    Py_DECREF(elements);
    return status;
}

static int walk_messages(const Member *member, PyObject *array, Py_ssize_t *index, Task *task)
{
    Py_ssize_t leaf_count = member->walk->leaf_count, start = *index;
    PyObject *elements = PySequence_Fast(array, "an array is a sequence");
    if (elements == NULL) return FAILED;
    int status = DONE;
    for (Py_ssize_t at = 0; status == DONE && at < PySequence_Fast_GET_SIZE(elements); at++) {
        int is_enough = task->found != NULL && PyList_GET_SIZE(task->found) > task->limit;
        if (is_enough && leaf_count != VARIABLE) break;
        PyObject *element = Py_NewRef(PySequence_Fast_GET_ITEM(elements, at));
        status = walk_message(member->walk, element, index, task);
        Py_DECREF(element);
    }
    if (leaf_count != VARIABLE) *index = start + PySequence_Fast_GET_SIZE(elements) * leaf_count;
    Py_DECREF(elements);
    return status;
}

static int walk_message(Walk *walk, PyObject *message, Py_ssize_t *index, Task *task)
{
    if (Py_TYPE(message) != walk->met) meet(walk, Py_TYPE(message));
    int status = DONE;
    for (Py_ssize_t at = 0; status == DONE && at < Py_SIZE(walk); at++) {
        const Member *member = &walk->members[at];
        /* another thread may have met another class, where Python ran */
        PyObject *value = field_of(message, member, Py_TYPE(message) == walk->met);
        if (value == NULL) return FAILED;
        if (member->length == SINGLE) {
            if (member->walk != NULL) status = walk_message(member->walk, value, index, task);
            else status = take_leaf(value, (*index)++, member->kind, task);
        } else if (member->walk != NULL) {
            status = walk_messages(member, value, index, task);
        } else {
            status = walk_scalars(walk, member, value, index, task);
        }
        Py_DECREF(value);
    }
    return status;
}

/* --- what Python calls ----------------------------------------------------------------------------------------- */

/* collect(message, index, found, limit, before): as in walkers.py. */
static PyObject *collect(PyObject *self, PyObject *const *args, size_t flags, PyObject *keywords)
{
    Py_ssize_t count = PyVectorcall_NARGS(flags);
    Task task = {.limit = PY_SSIZE_T_MAX};
    if (keywords != NULL || count < 3 || count > 5 || !PyList_CheckExact(args[2]) ||
        (count > 4 && !PyTuple_CheckExact(args[4]) && !PyList_CheckExact(args[4]))) {
        return PyErr_Format(PyExc_TypeError, "collect(message, index, list found, limit, fields before)");
    }
    task.found = args[2];
    task.before = count > 4 ? args[4] : NULL;
    Py_ssize_t index = PyLong_AsSsize_t(args[1]);
    if (count > 3) task.limit = PyLong_AsSsize_t(args[3]);
    if (PyErr_Occurred() || walk_message((Walk *)self, args[0], &index, &task) == FAILED) return NULL;
    return PyLong_FromSsize_t(index);
}

/* compare(message, written): as in fields.py. */
static PyObject *compare(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    PyObject *parts[4]; /* indices, values, kinds, moving */
    int is_right = count == 2 && PyTuple_Check(args[1]) && PyTuple_GET_SIZE(args[1]) == 4;
    for (int at = 0; is_right && at < 4; at++) parts[at] = PyTuple_GET_ITEM(args[1], at);
    is_right = is_right && PyBytes_CheckExact(parts[0]) && PyTuple_CheckExact(parts[1]) &&
               PyBytes_CheckExact(parts[2]) && PyBytes_CheckExact(parts[3]);
    Py_ssize_t number = is_right ? PyTuple_GET_SIZE(parts[1]) : 0;
    if (!is_right || PyBytes_GET_SIZE(parts[0]) != number * (Py_ssize_t)sizeof(int32_t) ||
        PyBytes_GET_SIZE(parts[2]) != number || PyBytes_GET_SIZE(parts[3]) != number) {
        return PyErr_Format(PyExc_TypeError, "compare(message, (indices, values, kinds, moving))");
    }
    PyObject *held = PyBytes_FromStringAndSize(NULL, number);
    if (held == NULL) return NULL;
    memset(PyBytes_AS_STRING(held), 0, (size_t)number);
    Task task = {.written = {(const int32_t *)PyBytes_AS_STRING(parts[0]), parts[1], PyBytes_AS_STRING(parts[2]),
                             PyBytes_AS_STRING(parts[3]), PyBytes_AS_STRING(held), number, 0, 0}};
    Py_ssize_t index = 0;
    if (walk_message((Walk *)self, args[0], &index, &task) == FAILED) {
        Py_DECREF(held);
        return NULL;
    }
    return Py_BuildValue("Nnn", held, task.written.tracked, index);
}

static PyTypeObject WalkType;

/* A member as Python gives it; 0 with an error. */
static int take_member(Member *member, PyObject *given)
{
    PyObject *what;
    if (!PyTuple_Check(given) ||
        !PyArg_ParseTuple(given, "UOnn", &member->name, &what, &member->length, &member->most)) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "a member is a tuple (name, kind or walk, length, most)");
        return 0;
    }
    int is_kind = PyUnicode_CheckExact(what) && PyUnicode_GET_LENGTH(what) == 1;
    if (!is_kind && Py_TYPE(what) != &WalkType) {
        PyErr_SetString(PyExc_TypeError, "a member is a letter for its kind, or a walk");
        return 0;
    }
    Py_INCREF(member->name);
    if (is_kind) member->kind = Py_NewRef(what);
    else member->walk = (Walk *)Py_NewRef(what);
    return 1;
}

static Py_ssize_t leaf_count_of(const Walk *walk)
{
    Py_ssize_t total = 0;
    for (Py_ssize_t at = 0; at < Py_SIZE(walk); at++) {
        const Member *member = &walk->members[at];
        Py_ssize_t inner = member->walk == NULL ? 1 : member->walk->leaf_count;
        if (member->length != SINGLE || inner == VARIABLE) return VARIABLE;
        total += inner;
    }
    return total;
}

static PyObject *walk_new(PyTypeObject *type, PyObject *args, PyObject *keywords)
{
    PyObject *members, *items_of;
    if (!PyArg_ParseTuple(args, "O!O:FieldWalk", &PyTuple_Type, &members, &items_of)) return NULL;
    Walk *walk = (Walk *)type->tp_alloc(type, PyTuple_GET_SIZE(members));
    if (walk == NULL) return NULL;
    walk->vectorcall = collect;
    walk->items_of = Py_NewRef(items_of);
    for (Py_ssize_t at = 0; at < PyTuple_GET_SIZE(members); at++) {
        if (take_member(&walk->members[at], PyTuple_GET_ITEM(members, at))) continue;
        walk->members[at].name = NULL;
        Py_DECREF(walk);
        return NULL;
    }
    walk->leaf_count = leaf_count_of(walk);
    return (PyObject *)walk;
}

static void walk_dealloc(PyObject *self)
{
    Walk *walk = (Walk *)self;
    for (Py_ssize_t at = 0; at < Py_SIZE(walk); at++) {
        Py_XDECREF(walk->members[at].name);
        Py_XDECREF(walk->members[at].kind);
        Py_XDECREF(walk->members[at].walk);
    }
    Py_XDECREF(walk->items_of);
    Py_XDECREF(walk->met);
    Py_TYPE(self)->tp_free(self);
}

static PyMethodDef methods[] = {
    {"compare", (PyCFunction)(void (*)(void))compare, METH_FASTCALL, "compare(message, written): as in fields.py."},
    {NULL, NULL, 0, NULL},
};

static PyTypeObject WalkType = {
    PyVarObject_HEAD_INIT(NULL, 0)
    .tp_name = "rosslt._core.FieldWalk",
    .tp_doc = "FieldWalk(members, items_of): the walk of a message class, as `field_walk` of fields.py makes it.",
    .tp_basicsize = offsetof(Walk, members),
    .tp_itemsize = sizeof(Member),
    .tp_flags = Py_TPFLAGS_DEFAULT | _Py_TPFLAGS_HAVE_VECTORCALL,
    .tp_vectorcall_offset = offsetof(Walk, vectorcall),
    .tp_call = PyVectorcall_Call,
    .tp_methods = methods,
    .tp_new = walk_new,
    .tp_dealloc = walk_dealloc,
};

int add_walks(PyObject *module)
{
    return PyType_Ready(&WalkType) < 0 ? -1 : PyObject_SetAttrString(module, "FieldWalk", (PyObject *)&WalkType);
}
