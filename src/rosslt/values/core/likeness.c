/* Were values made by the same operations from the same sources? A node that sends what moves asks it of each field of
   each message. `is_made_alike` of `tracked.py`.

   No Python runs while two expressions are walked, so nothing of them has to be held. */

#include "core.h"

/* What is known of two values, or of all that they were made of. */
enum { FAILED = -1, NO, YES, NOT_HERE };

typedef struct {
    PyObject *one, *other;
} Pair;

typedef struct {
    Pair *waiting; /* to be compared */
    Pair *seen;    /* compared before, by the hash of their addresses: those that may be met again */
    Py_ssize_t waiting_count, waiting_room, seen_count, seen_room;
} Walk;

static int no_memory(void)
{
    PyErr_NoMemory();
    return FAILED;
}

static int wait_for(Walk *walk, PyObject *one, PyObject *other)
{
    if (one == other) return YES;
    if (walk->waiting_count == walk->waiting_room) {
        Py_ssize_t room = walk->waiting_room ? 2 * walk->waiting_room : 64;
        Pair *waiting = PyMem_Realloc(walk->waiting, (size_t)room * sizeof *waiting);
        if (waiting == NULL) return no_memory();
        walk->waiting = waiting;
        walk->waiting_room = room;
    }
    walk->waiting[walk->waiting_count++] = (Pair){one, other};
    return YES;
}

/* Where a pair is among those seen, or may be put. */
static Pair *place_of(const Walk *walk, Pair pair)
{
    size_t mask = (size_t)walk->seen_room - 1;
    size_t hash = (((uintptr_t)pair.one >> 4) * 31 + ((uintptr_t)pair.other >> 4)) * 0x9E3779B97F4A7C15u;
    size_t at = hash >> 20 & mask;
    while (walk->seen[at].one != NULL && (walk->seen[at].one != pair.one || walk->seen[at].other != pair.other)) {
        at = (at + 1) & mask;
    }
    return &walk->seen[at];
}

/* Whether a pair was seen before (YES); from now on it was. */
static int was_seen(Walk *walk, Pair pair)
{
    if (2 * walk->seen_count >= walk->seen_room) {
        Walk larger = {.seen_room = walk->seen_room ? 2 * walk->seen_room : 64};
        larger.seen = PyMem_Calloc((size_t)larger.seen_room, sizeof *larger.seen);
        if (larger.seen == NULL) return no_memory();
        for (Py_ssize_t at = 0; at < walk->seen_room; at++) {
            if (walk->seen[at].one != NULL) *place_of(&larger, walk->seen[at]) = walk->seen[at];
        }
        PyMem_Free(walk->seen);
        walk->seen = larger.seen;
        walk->seen_room = larger.seen_room;
    }
    Pair *place = place_of(walk, pair);
    if (place->one != NULL) return YES;
    *place = pair;
    walk->seen_count++;
    return NO;
}

/* Whether two values alone were made in the same way; what they were made of has to be compared yet. */
static int compare(Walk *walk, PyObject *one, PyObject *other)
{
    if (Py_TYPE(one) != Py_TYPE(other)) return NO;
    if (!IS_OURS(one)) {
        int is_tracked = PySet_Contains(tracked_classes, (PyObject *)Py_TYPE(one));
        return is_tracked == 1 ? NOT_HERE : is_tracked;
    }
    const Record *record = record_of(one), *other_record = record_of(other);
    if (record->form == lazy_form || other_record->form == lazy_form) return NOT_HERE;
    if (record->form != other_record->form) return NO;
    if (record->form == source_form) {
        int is_same = is_same_source(record->first, other_record->first);
        return is_same == UNKNOWN_SOURCE ? NOT_HERE : is_same;
    }
    if (IS_SINGLE(record->kind)) return wait_for(walk, record->first, other_record->first);
    if (record->kind != OTHER) {
        int status = wait_for(walk, record->first, other_record->first);
        return status == YES ? wait_for(walk, record->second, other_record->second) : status;
    }
    if (record->form != affine_form || !PyTuple_CheckExact(record->first) || !PyTuple_CheckExact(other_record->first)) {
        return NOT_HERE;
    }
    Py_ssize_t count = PyTuple_GET_SIZE(record->first);
    int status = PyTuple_GET_SIZE(other_record->first) == count ? YES : NO;
    for (Py_ssize_t at = 0; status == YES && at < count; at++) {
        PyObject *term = PyTuple_GET_ITEM(record->first, at), *other_term = PyTuple_GET_ITEM(other_record->first, at);
        if (!PyTuple_CheckExact(term) || !PyTuple_CheckExact(other_term)) return NOT_HERE;
        status = wait_for(walk, PyTuple_GET_ITEM(term, 0), PyTuple_GET_ITEM(other_term, 0));
    }
    return status;
}

/* Whether two values were made alike. NO is certain whatever else there is; NOT_HERE where Python alone knows. */
static int walk_both(PyObject *one, PyObject *other)
{
    Walk walk = {0};
    int status = wait_for(&walk, one, other), known = YES;
    while (status == YES && walk.waiting_count > 0) {
        Pair pair = walk.waiting[--walk.waiting_count];
        /* what one other value only was made of is met once */
        int is_shared = Py_REFCNT(pair.one) > 1 && Py_REFCNT(pair.other) > 1;
        int is_seen = is_shared ? was_seen(&walk, pair) : NO;
        if (is_seen == YES) continue;
        status = is_seen == FAILED ? FAILED : compare(&walk, pair.one, pair.other);
        if (status == NOT_HERE) {
            known = NOT_HERE;
            status = YES;
        }
    }
    PyMem_Free(walk.waiting);
    PyMem_Free(walk.seen);
    return status == YES ? known : status;
}

int is_made_alike(PyObject *one, PyObject *other)
{
    if (one == other) return YES;
    int status = walk_both(one, other);
    if (status != NOT_HERE) return status;
    PyObject *answer = PyObject_CallFunctionObjArgs(alike_of_python, one, other, NULL);
    status = answer == NULL ? FAILED : PyObject_IsTrue(answer);
    Py_XDECREF(answer);
    return status;
}

/* Two sequences of the same length, as lists or tuples that nobody else changes: 0 with an error. */
static int take_columns(PyObject *const *args, Py_ssize_t count, PyObject *columns[2])
{
    columns[0] = columns[1] = NULL;
    if (count != 2) {
        PyErr_SetString(PyExc_TypeError, "two sequences of values");
        return 0;
    }
    for (int at = 0; at < 2; at++) {
        columns[at] = PySequence_Tuple(args[at]);
        if (columns[at] == NULL) return 0;
    }
    if (PyTuple_GET_SIZE(columns[0]) == PyTuple_GET_SIZE(columns[1])) return 1;
    PyErr_SetString(PyExc_ValueError, "as many of the one as of the others");
    return 0;
}

/* As `are_made_alike` in tracked.py. */
PyObject *are_made_alike(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    PyObject *columns[2];
    int status = take_columns(args, count, columns) ? YES : FAILED;
    for (Py_ssize_t at = 0; status == YES && at < PyTuple_GET_SIZE(columns[0]); at++) {
        status = is_made_alike(PyTuple_GET_ITEM(columns[0], at), PyTuple_GET_ITEM(columns[1], at));
    }
    Py_XDECREF(columns[0]);
    Py_XDECREF(columns[1]);
    return status == FAILED ? NULL : PyBool_FromLong(status);
}

/* As `made_alike` in tracked.py. */
PyObject *made_alike(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    PyObject *columns[2], *found = NULL;
    if (take_columns(args, count, columns)) found = PyList_New(PyTuple_GET_SIZE(columns[0]));
    for (Py_ssize_t at = 0; found != NULL && at < PyTuple_GET_SIZE(columns[0]); at++) {
        int status = is_made_alike(PyTuple_GET_ITEM(columns[0], at), PyTuple_GET_ITEM(columns[1], at));
        if (status == FAILED) Py_CLEAR(found);
        else PyList_SET_ITEM(found, at, PyBool_FromLong(status));
    }
    Py_XDECREF(columns[0]);
    Py_XDECREF(columns[1]);
    return found;
}
