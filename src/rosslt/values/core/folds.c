/* Which slopes have values in the source values below them, at their present ones? `_swept` and `_resized` of
   `affine.py`. */

#include "core.h"

/* A node below some values. What is referred to is held. */
typedef struct {
    PyObject *node, *form, *first, *second;
    Py_ssize_t edges; /* the index of its first slope; those of the next node in the order end them */
    Slope weight;     /* the slope in it of the value that is swept, as far as that is added up */
    int kind, is_exact, is_reached;
} Below;

/* The slope of a node in one of its operands. */
typedef struct {
    Py_ssize_t operand;
    Slope slope;
} Edge;

typedef struct {
    Below *nodes;       /* in the order in which they were found */
    Py_ssize_t *order;  /* operands before their users, left before right */
    Py_ssize_t *places; /* of the nodes, by the hash of their addresses; -1 where there is none */
    Edge *edges;
    Py_ssize_t count, ordered, room, edge_count, edge_room;
    int bound; /* only what is larger is walked, by its record; 0 to walk all, by folds where they are remembered */
} Sweep;

/* What Python has to do is not here: no error, but no answer. */
enum { FAILED = -1, DONE, NOT_HERE };

/* --- the nodes below values ----------------------------------------------------------------------------------- */

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
    Record *record = record_of(node);
    Below below = {.node = Py_NewRef(node), .kind = record->kind, .is_exact = 1};
    PyObject *used = sweep->bound || record->fold == NULL ? NULL : Py_NewRef(record->fold);
    if (used != NULL && !is_record(used)) {
        Py_DECREF(used);
        Py_DECREF(node);
        return NOT_HERE;
    }
    if (used != NULL) below.kind = OTHER;
    else if (record->form == lazy_form) used = resolved(node, &below.kind);
    if (used == NULL && PyErr_Occurred()) {
        Py_DECREF(node);
        return FAILED;
    }
    below.form = Py_NewRef(used == NULL ? record->form : PyTuple_GET_ITEM(used, 0));
    below.first = Py_NewRef(used == NULL ? record->first : PyTuple_GET_ITEM(used, 1));
    below.second = Py_NewRef(used == NULL ? record->second : PyTuple_GET_ITEM(used, 2));
    Py_XDECREF(used);
    sweep->nodes[sweep->count] = below;
    *place_in(sweep, node) = sweep->count++;
    return DONE;
}

/* How many operands a node has that are walked; -1 where Python alone knows. */
static Py_ssize_t operand_count(const Sweep *sweep, const Below *below)
{
    if (record_of(below->node)->size <= sweep->bound) return 0;
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
    int status = sweep->room ? DONE : grow(sweep);
    for (PyObject *next = value; status == DONE;) {
        if (next != NULL && *place_in(sweep, next) < 0) {
            status = find(sweep, next);
            if (status != DONE) break;
            Py_ssize_t place = sweep->count - 1, count = operand_count(sweep, &sweep->nodes[place]);
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

static void release(Sweep *sweep)
{
    for (Py_ssize_t at = 0; at < sweep->count; at++) {
        Py_DECREF(sweep->nodes[at].form);
        Py_DECREF(sweep->nodes[at].first);
        Py_DECREF(sweep->nodes[at].second);
        Py_DECREF(sweep->nodes[at].node);
    }
    PyMem_Free(sweep->nodes);
    PyMem_Free(sweep->order);
    PyMem_Free(sweep->places);
    PyMem_Free(sweep->edges);
}

/* --- their slopes ---------------------------------------------------------------------------------------------- */

static int add_edge(Sweep *sweep, PyObject *operand, Slope slope)
{
    if (sweep->edge_count == sweep->edge_room) {
        Py_ssize_t room = 2 * sweep->edge_room + 256;
        Edge *edges = PyMem_Realloc(sweep->edges, (size_t)room * sizeof *edges);
        if (edges == NULL) return no_memory();
        sweep->edges = edges;
        sweep->edge_room = room;
    }
    sweep->edges[sweep->edge_count++] = (Edge){*place_in(sweep, operand), slope};
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

static int add_operator(Sweep *sweep, Below *below, const Slope slopes[2])
{
    int operator = OPERATOR_OF(below->kind), side = SIDE_OF(below->kind);
    Slope slope = slopes[side == RIGHT];
    if (operator == MULTIPLY && side == BOTH) below->is_exact = 0;
    if (operator == DIVIDE && side != LEFT) below->is_exact = 0;
    if (side != BOTH && slope.value == 0.0) {
        double zero;
        /* a slope of 0 may stand for one that no float can hold */
        if (operator != MULTIPLY || !as_double(below->second, &zero) || zero != 0.0) below->is_exact = 0;
    }
    int status = add_edge(sweep, below->first, slope);
    return status == DONE && side == BOTH ? add_edge(sweep, below->second, slopes[1]) : status;
}

/* Add a slope that Python knows. */
static int add_number(Sweep *sweep, Below *below, Py_ssize_t at, PyObject *number)
{
    Slope slope;
    if (!as_slope(number, &slope)) return NOT_HERE;
    double constant;
    /* a slope of 0 may stand for one that no float can hold, unless the constant is 0 */
    if (IS_SINGLE(below->kind) && slope.value == 0.0 && !(as_double(below->second, &constant) && constant == 0.0)) {
        below->is_exact = 0;
    }
    return add_edge(sweep, operand_at(below, at), slope);
}

/* Add the slopes of a node of any other operation, which Python knows. */
static int add_other(Sweep *sweep, Below *below)
{
    PyObject *slopes = NULL, *record = NULL, *plains = NULL;
    int status = FAILED, is_affine = truth_of(below->form, AFFINE);
    Py_ssize_t count = operand_count(sweep, below);
    if (is_affine < 0) return FAILED;
    below->is_exact = is_affine;
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
        status = add_number(sweep, below, at, PySequence_Fast_GET_ITEM(slopes, at));
    }
done:
    if (status == FAILED && !PyErr_Occurred()) status = NOT_HERE;
    Py_XDECREF(slopes);
    Py_XDECREF(record);
    Py_XDECREF(plains);
    return status;
}

static int add_fold(Sweep *sweep, Below *below)
{
    int status = DONE;
    below->is_exact = PyObject_IsTrue(below->second);
    if (below->is_exact < 0) return FAILED;
    for (Py_ssize_t at = 0; status == DONE && at < PyTuple_GET_SIZE(below->first); at++) {
        PyObject *slope = PyTuple_GET_ITEM(PyTuple_GET_ITEM(below->first, at), 1);
        if (PyFloat_CheckExact(slope) && !isfinite(PyFloat_AS_DOUBLE(slope))) return NOT_HERE;
        status = add_number(sweep, below, at, slope);
    }
    return status;
}

/* Take the slopes of all nodes, in their order. */
static int add_edges(Sweep *sweep)
{
    int status = DONE;
    for (Py_ssize_t at = 0; status == DONE && at < sweep->ordered; at++) {
        Below *below = &sweep->nodes[sweep->order[at]];
        Slope slopes[2];
        below->edges = sweep->edge_count;
        if (below->form == source_form) continue;
        if (below->kind == OTHER) {
            status = add_fold(sweep, below);
            continue;
        }
        status = slopes_of(below, slopes);
        if (status == DONE) status = add_operator(sweep, below, slopes);
        else if (status == NOT_HERE) status = add_other(sweep, below);
    }
    return status;
}

/* --- added up -------------------------------------------------------------------------------------------------- */

/* Add a slope for an operand to its weight; the sum is whole where both are. */
static int add_weight(Below *operand, Slope by, Slope slope, int *is_exact)
{
    int is_whole = slope.is_whole && by.is_whole;
    double part = by.value * slope.value;
    Slope before = operand->is_reached ? operand->weight : (Slope){0.0, 1};
    Slope total = {before.value + part, is_whole && before.is_whole};
    if ((is_whole && fabs(part) > MOST_EXACT) || (total.is_whole && fabs(total.value) > MOST_EXACT)) return NOT_HERE;
    if (!isfinite(total.value)) {
        *is_exact = 0;
        total = (Slope){0.0, 1};
    }
    operand->weight = total;
    operand->is_reached = 1;
    return DONE;
}

/* `([(source's value, slope), ...], is_exact)` of one of the values; NULL without an error where Python has to do it. */
static PyObject *sum(Sweep *sweep, PyObject *value)
{
    Below *root = &sweep->nodes[*place_in(sweep, value)];
    Py_ssize_t end = 0;
    int is_exact = 1;
    while (&sweep->nodes[sweep->order[end]] != root) end++;
    for (Py_ssize_t at = 0; at <= end; at++) sweep->nodes[sweep->order[at]].is_reached = 0;
    root->weight = (Slope){1.0, 1};
    root->is_reached = 1;
    for (Py_ssize_t at = end; at >= 0; at--) {
        const Below *below = &sweep->nodes[sweep->order[at]];
        Py_ssize_t last = at + 1 < sweep->ordered ? sweep->nodes[sweep->order[at + 1]].edges : sweep->edge_count;
        if (!below->is_reached) continue;
        is_exact = is_exact && below->is_exact;
        for (Py_ssize_t edge = below->edges; edge < last; edge++) {
            Below *operand = &sweep->nodes[sweep->edges[edge].operand];
            if (add_weight(operand, below->weight, sweep->edges[edge].slope, &is_exact) != DONE) return NULL;
        }
    }
    PyObject *leaves = PyList_New(0);
    for (Py_ssize_t at = 0; leaves != NULL && at <= end; at++) {
        const Below *below = &sweep->nodes[sweep->order[at]];
        if (below->form != source_form || !below->is_reached) continue;
        double weight = below->weight.value;
        PyObject *slope = below->weight.is_whole ? PyLong_FromDouble(weight) : PyFloat_FromDouble(weight);
        PyObject *leaf = slope == NULL ? NULL : PyTuple_Pack(2, below->node, slope);
        if (leaf == NULL || PyList_Append(leaves, leaf) < 0) Py_CLEAR(leaves);
        Py_XDECREF(slope);
        Py_XDECREF(leaf);
    }
    PyObject *result = leaves == NULL ? NULL : PyTuple_Pack(2, leaves, is_exact ? Py_True : Py_False);
    Py_XDECREF(leaves);
    return result;
}

/* `_swept` in affine.py of each of some values; NotImplemented where that has to do it. */
PyObject *swept(PyObject *module, PyObject *values)
{
    Sweep sweep = {.bound = 0};
    PyObject *roots = PySequence_Tuple(values), *results = NULL;
    int status = roots == NULL ? FAILED : DONE;
    for (Py_ssize_t at = 0; status == DONE && at < PyTuple_GET_SIZE(roots); at++) {
        status = find_all(&sweep, PyTuple_GET_ITEM(roots, at));
    }
    if (status == DONE) status = add_edges(&sweep);
    if (status == DONE) results = PyList_New(0);
    for (Py_ssize_t at = 0; results != NULL && at < PyTuple_GET_SIZE(roots); at++) {
        PyObject *result = sum(&sweep, PyTuple_GET_ITEM(roots, at));
        if (result == NULL && !PyErr_Occurred()) status = NOT_HERE;
        if (result == NULL || PyList_Append(results, result) < 0) Py_CLEAR(results);
        Py_XDECREF(result);
    }
    release(&sweep);
    Py_XDECREF(roots);
    return status == NOT_HERE ? Py_NewRef(Py_NotImplemented) : results;
}

/* --- sizes ----------------------------------------------------------------------------------------------------- */

/* As `_resized` in affine.py; NotImplemented where that has to do it. */
PyObject *resized(PyObject *module, PyObject *args)
{
    Sweep sweep = {0};
    PyObject *value, *borders = NULL;
    if (!PyArg_ParseTuple(args, "Oi:resized", &value, &sweep.bound)) return NULL;
    int status = find_all(&sweep, value);
    if (status == DONE) borders = PyList_New(0);
    for (Py_ssize_t at = 0; borders != NULL && at < sweep.ordered; at++) {
        const Below *below = &sweep.nodes[sweep.order[at]];
        Record *record = record_of(below->node);
        if (record->size > sweep.bound && below->kind != OTHER) {
            int size = record_of(below->first)->size;
            record->size = IS_SINGLE(below->kind) ? size + 1 : joint_size(size, record_of(below->second)->size);
        } else if (record->size > sweep.bound / 2 && PyList_Append(borders, below->node) < 0) {
            Py_CLEAR(borders);
        }
    }
    release(&sweep);
    return status == NOT_HERE ? Py_NewRef(Py_NotImplemented) : borders;
}
