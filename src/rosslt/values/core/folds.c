/* Which slopes has a value in the source values below it, at their present ones? `_swept` of `affine.py`. */

#include "core.h"

/* A node below a value that is folded. What is referred to is held. */
typedef struct {
    PyObject *node, *form, *first, *second;
    Slope weight; /* the value's slope in it, as far as that is added up */
    int kind;
} Below;

typedef struct {
    Below *nodes;       /* in the order in which they were found */
    Py_ssize_t *order;  /* operands before their users, left before right */
    Py_ssize_t *places; /* of the nodes, by the hash of their addresses; -1 where there is none */
    Py_ssize_t count, ordered, room;
    int is_exact; /* whether the slopes say all: the value is affine in the source values */
} Sweep;

/* What Python has to do is not here: no error, but no answer. */
enum { FAILED = -1, DONE, NOT_HERE };

/* --- the nodes below a value ---------------------------------------------------------------------------------- */

static Py_ssize_t *place_in(const Sweep *sweep, const PyObject *node)
{
    size_t mask = 2 * (size_t)sweep->room - 1, at = ((uintptr_t)node >> 4) * 0x9E3779B97F4A7C15u >> 20 & mask;
    while (sweep->places[at] >= 0 && sweep->nodes[sweep->places[at]].node != node) at = (at + 1) & mask;
    return &sweep->places[at];
}

static int no_memory(void)
{
    PyErr_NoMemory();
    return FAILED;
}

/* Make room for twice as many nodes. */
static int grow(Sweep *sweep)
{
    Py_ssize_t room = sweep->room ? 2 * sweep->room : 256;
    Below *nodes = PyMem_Realloc(sweep->nodes, (size_t)room * sizeof *nodes);
    if (nodes != NULL) sweep->nodes = nodes;
    Py_ssize_t *order = PyMem_Realloc(sweep->order, (size_t)room * sizeof *order);
    if (order != NULL) sweep->order = order;
    Py_ssize_t *places = PyMem_Realloc(sweep->places, 2 * (size_t)room * sizeof *places);
    if (places != NULL) sweep->places = places;
    if (nodes == NULL || order == NULL || places == NULL) return no_memory();
    sweep->room = room;
    for (Py_ssize_t at = 0; at < 2 * room; at++) places[at] = -1;
    for (Py_ssize_t at = 0; at < sweep->count; at++) *place_in(sweep, nodes[at].node) = at;
    return DONE;
}

/* Put a node among those found, with its fold or its record. */
static int find(Sweep *sweep, PyObject *node)
{
    if (!IS_OURS(node)) return NOT_HERE;
    if (sweep->count == sweep->room && grow(sweep) != DONE) return FAILED;
    int kind = OTHER;
    PyObject *fold = record_of(node)->fold;
    if (fold != NULL && !is_record(fold)) return NOT_HERE;
    PyObject *used = fold != NULL ? Py_NewRef(fold) : resolved(node, &kind);
    if (used == NULL) return FAILED;
    PyObject *form = PyTuple_GET_ITEM(used, 0), *first = PyTuple_GET_ITEM(used, 1), *second = PyTuple_GET_ITEM(used, 2);
    sweep->nodes[sweep->count] = (Below){
        Py_NewRef(node), Py_NewRef(form), Py_NewRef(first), Py_NewRef(second), {0.0, 1}, kind,
    };
    Py_DECREF(used);
    *place_in(sweep, node) = sweep->count++;
    return DONE;
}

/* How many operands a node has; -1 where Python alone knows. */
static Py_ssize_t operand_count(const Below *below)
{
    if (IS_SINGLE(below->kind)) return 1;
    if (below->kind != OTHER) return 2;
    if (below->form == source_form) return 0;
    if (below->form == affine_form && PyTuple_CheckExact(below->first)) return PyTuple_GET_SIZE(below->first);
    return -1;
}

static PyObject *operand_at(const Below *below, Py_ssize_t at)
{
    if (below->kind != OTHER) return at == 0 ? below->first : below->second;
    PyObject *term = PyTuple_GET_ITEM(below->first, at);
    return PyTuple_CheckExact(term) && PyTuple_GET_SIZE(term) == 2 ? PyTuple_GET_ITEM(term, 0) : Py_None;
}

/* Find all nodes below a value, and their order. */
static int find_all(Sweep *sweep, PyObject *value)
{
    struct Step {
        PyObject *node;   /* to be found, held by its user; NULL where it was */
        Py_ssize_t place; /* its place, once it was found */
    } *stack = NULL;
    Py_ssize_t height = 0, room = 0;
    int status = grow(sweep);
    for (PyObject *next = value; status == DONE;) {
        if (next != NULL && *place_in(sweep, next) < 0) {
            status = find(sweep, next);
            if (status != DONE) break;
            Py_ssize_t place = sweep->count - 1, count = operand_count(&sweep->nodes[place]);
            if (count < 0) {
                status = NOT_HERE;
                break;
            }
            if (height + count + 1 > room) {
                room = 2 * room + count + 64;
                struct Step *larger = PyMem_Realloc(stack, (size_t)room * sizeof *stack);
                if (larger == NULL) {
                    status = no_memory();
                    break;
                }
                stack = larger;
            }
            stack[height++] = (struct Step){NULL, place};
            for (Py_ssize_t at = count - 1; at >= 0; at--) {
                stack[height++] = (struct Step){operand_at(&sweep->nodes[place], at), 0};
            }
        }
        if (height == 0) break;
        struct Step top = stack[--height];
        next = top.node;
        if (next == NULL) sweep->order[sweep->ordered++] = top.place;
    }
    PyMem_Free(stack);
    return status;
}

/* --- their slopes, added up ------------------------------------------------------------------------------------ */

/* Add a slope for an operand to its weight; the sum is whole where both are. */
static int add_weight(Sweep *sweep, PyObject *operand, const Below *user, Slope slope)
{
    Slope *weight = &sweep->nodes[*place_in(sweep, operand)].weight;
    int is_whole = slope.is_whole && user->weight.is_whole;
    double part = user->weight.value * slope.value;
    Slope total = {weight->value + part, is_whole && weight->is_whole};
    if ((is_whole && fabs(part) > MOST_EXACT) || (total.is_whole && fabs(total.value) > MOST_EXACT)) return NOT_HERE;
    if (!isfinite(total.value)) {
        sweep->is_exact = 0;
        total = (Slope){0.0, 1};
    }
    *weight = total;
    return DONE;
}

/* The slopes of an operator on numbers in what stands on its left and right, as the table has them; NOT_HERE for
   others. */
static int slopes_of(const Below *below, Slope slopes[2])
{
    if (below->kind < OPERATOR || OPERATOR_OF(below->kind) > DIVIDE) return NOT_HERE;
    int is_right = SIDE_OF(below->kind) == RIGHT; /* the constant stands on the left */
    Slope left, right;
    PyObject *a = plain_of(is_right ? below->second : below->first);
    PyObject *b = plain_of(is_right ? below->first : below->second);
    int are_numbers = a != NULL && b != NULL && as_slope(a, &left) && as_slope(b, &right);
    Py_XDECREF(a);
    Py_XDECREF(b);
    if (!are_numbers) return PyErr_Occurred() ? FAILED : NOT_HERE;
    slopes[0] = slopes[1] = (Slope){1.0, 1};
    switch (OPERATOR_OF(below->kind)) {
    case SUBTRACT:
        slopes[1].value = -1.0;
        break;
    case MULTIPLY:
        slopes[0] = right;
        slopes[1] = left;
        break;
    case DIVIDE:
        if (right.value == 0.0) return NOT_HERE;
        slopes[0] = (Slope){1.0 / right.value, 0};
        slopes[1] = (Slope){-left.value / right.value / right.value, 0};
        break;
    }
    for (int at = 0; at < 2; at++) {
        if (!isfinite(slopes[at].value)) slopes[at] = (Slope){0.0, 1};
    }
    return DONE;
}

/* Pass the weight of a node of an operator on to its operands. */
static int pass_on_operator(Sweep *sweep, const Below *below, const Slope slopes[2])
{
    int operator = OPERATOR_OF(below->kind), side = SIDE_OF(below->kind);
    Slope slope = slopes[side == RIGHT];
    if (operator == MULTIPLY && side == BOTH) sweep->is_exact = 0;
    if (operator == DIVIDE && side != LEFT) sweep->is_exact = 0;
    if (side != BOTH && slope.value == 0.0) {
        double zero;
        /* a slope of 0 may stand for one that no float can hold */
        if (operator != MULTIPLY || !as_double(below->second, &zero) || zero != 0.0) sweep->is_exact = 0;
    }
    int status = add_weight(sweep, below->first, below, slope);
    return status == DONE && side == BOTH ? add_weight(sweep, below->second, below, slopes[1]) : status;
}

/* Pass a slope that Python knows on to an operand. */
static int pass_on_number(Sweep *sweep, const Below *below, Py_ssize_t at, PyObject *number)
{
    Slope slope;
    if (!as_slope(number, &slope)) return NOT_HERE;
    double constant;
    /* a slope of 0 may stand for one that no float can hold, unless the constant is 0 */
    if (IS_SINGLE(below->kind) && slope.value == 0.0 && !(as_double(below->second, &constant) && constant == 0.0)) {
        sweep->is_exact = 0;
    }
    return add_weight(sweep, operand_at(below, at), below, slope);
}

/* Pass the weight of a node of any other operation on, of which Python knows the slopes. */
static int pass_on_other(Sweep *sweep, const Below *below)
{
    PyObject *slopes = NULL, *record = NULL, *plains = NULL;
    int status = FAILED, is_affine = truth_of(below->form, AFFINE);
    Py_ssize_t count = operand_count(below);
    if (is_affine < 0) return FAILED;
    sweep->is_exact = sweep->is_exact && is_affine;
    record = PyTuple_Pack(3, below->form, below->first, below->second);
    plains = PyTuple_New(count);
    for (Py_ssize_t at = 0; record != NULL && plains != NULL && at < count; at++) {
        PyObject *plain = plain_of(operand_at(below, at));
        if (plain == NULL) goto done;
        PyTuple_SET_ITEM(plains, at, plain);
    }
    if (record == NULL || plains == NULL) goto done;
    slopes = PyObject_CallFunctionObjArgs(slopes_or_zeros, record, plains, NULL);
    if (slopes == NULL) goto done;
    Py_SETREF(slopes, PySequence_Fast(slopes, "slopes are a sequence"));
    if (slopes == NULL || PySequence_Fast_GET_SIZE(slopes) != count) goto done;
    status = DONE;
    for (Py_ssize_t at = 0; status == DONE && at < count; at++) {
        status = pass_on_number(sweep, below, at, PySequence_Fast_GET_ITEM(slopes, at));
    }
done:
    if (status == FAILED && !PyErr_Occurred()) status = NOT_HERE;
    Py_XDECREF(slopes);
    Py_XDECREF(record);
    Py_XDECREF(plains);
    return status;
}

/* Pass the weight of a fold on. */
static int pass_on_fold(Sweep *sweep, const Below *below)
{
    int truth = PyObject_IsTrue(below->second), status = truth < 0 ? FAILED : DONE;
    sweep->is_exact = sweep->is_exact && truth;
    for (Py_ssize_t at = 0; status == DONE && at < PyTuple_GET_SIZE(below->first); at++) {
        PyObject *slope = PyTuple_GET_ITEM(PyTuple_GET_ITEM(below->first, at), 1);
        if (PyFloat_CheckExact(slope) && !isfinite(PyFloat_AS_DOUBLE(slope))) return NOT_HERE;
        status = pass_on_number(sweep, below, at, slope);
    }
    return status;
}

/* Add up the slopes of the last node in the order for all others. */
static int pass_on_all(Sweep *sweep)
{
    int status = DONE;
    sweep->nodes[sweep->order[sweep->ordered - 1]].weight = (Slope){1.0, 1};
    for (Py_ssize_t at = sweep->ordered - 1; status == DONE && at >= 0; at--) {
        const Below *below = &sweep->nodes[sweep->order[at]];
        if (below->form == source_form) continue;
        if (below->kind == OTHER) {
            status = pass_on_fold(sweep, below);
        } else {
            Slope slopes[2];
            status = slopes_of(below, slopes);
            if (status == DONE) status = pass_on_operator(sweep, below, slopes);
            else if (status == NOT_HERE) status = pass_on_other(sweep, below);
        }
    }
    return status;
}

/* `[(source's value, slope), ...]` of a sweep. */
static PyObject *leaves_of(const Sweep *sweep)
{
    PyObject *leaves = PyList_New(0);
    for (Py_ssize_t at = 0; leaves != NULL && at < sweep->ordered; at++) {
        const Below *below = &sweep->nodes[sweep->order[at]];
        if (below->form != source_form) continue;
        double weight = below->weight.value;
        PyObject *slope = below->weight.is_whole ? PyLong_FromDouble(weight) : PyFloat_FromDouble(weight);
        PyObject *leaf = slope == NULL ? NULL : PyTuple_Pack(2, below->node, slope);
        if (leaf == NULL || PyList_Append(leaves, leaf) < 0) Py_CLEAR(leaves);
        Py_XDECREF(slope);
        Py_XDECREF(leaf);
    }
    return leaves;
}

/* As `_swept` in affine.py; NotImplemented where that has to do it. */
PyObject *swept(PyObject *module, PyObject *value)
{
    Sweep sweep = {.is_exact = 1};
    int status = find_all(&sweep, value);
    if (status == DONE) status = pass_on_all(&sweep);
    PyObject *leaves = status == DONE ? leaves_of(&sweep) : NULL, *result = NULL;
    if (leaves != NULL) result = PyTuple_Pack(2, leaves, sweep.is_exact ? Py_True : Py_False);
    if (status == NOT_HERE) result = Py_NewRef(Py_NotImplemented);
    Py_XDECREF(leaves);
    for (Py_ssize_t at = 0; at < sweep.count; at++) {
        Py_DECREF(sweep.nodes[at].form);
        Py_DECREF(sweep.nodes[at].first);
        Py_DECREF(sweep.nodes[at].second);
        Py_DECREF(sweep.nodes[at].node);
    }
    PyMem_Free(sweep.nodes);
    PyMem_Free(sweep.order);
    PyMem_Free(sweep.places);
    return result;
}
