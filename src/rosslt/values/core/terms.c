/* Of which sources is a value affine, with which slopes? `affine` of `affine.py`, for values that few operations made.
   On the way down to the sources the slopes are multiplied; what several ways lead to is passed several times.

   Nothing is allocated while an expression is walked, and so nothing of Python runs: only what was found is held. */

#include "core.h"

enum { FAILED = TERMS_FAILED, NOT_AFFINE = NO_TERMS, DONE = TERMS_FOUND, NOT_HERE = TERMS_OF_PYTHON };

/* A product of slopes: 0 where Python has to say it. */
static int multiply(Slope *slope, Slope by)
{
    slope->value *= by.value;
    slope->is_whole = slope->is_whole && by.is_whole;
    return slope->value - slope->value == 0.0 && (!slope->is_whole || fabs(slope->value) <= MOST_EXACT);
}

/* Whether two sources' values are the same number of the same source: NOT_AFFINE where not of the same source. */
static int is_same_reading(PyObject *one, PyObject *other)
{
    int is_same = is_same_source(record_of(one)->first, record_of(other)->first);
    if (is_same != 1) return is_same == 0 ? NOT_AFFINE : is_same == UNKNOWN_SOURCE ? NOT_HERE : FAILED;
    if (!IS_FLOAT(one) || !IS_FLOAT(other)) return one == other ? DONE : NOT_HERE;
    return PyFloat_AS_DOUBLE(one) == PyFloat_AS_DOUBLE(other) ? DONE : NOT_HERE;
}

static int add_term(Terms *terms, PyObject *leaf, Slope slope, Slope rise)
{
    if (!IS_OURS(leaf) || record_of(leaf)->form != source_form || !multiply(&slope, rise)) return NOT_HERE;
    for (int at = 0; at < terms->term_count; at++) {
        Term *term = &terms->terms[at];
        int status = is_same_reading(term->leaf, leaf);
        if (status == NOT_AFFINE) continue;
        if (status != DONE) return status;
        term->slope.value += slope.value;
        term->slope.is_whole = term->slope.is_whole && slope.is_whole;
        return multiply(&term->slope, (Slope){1.0, 1}) ? DONE : NOT_HERE;
    }
    if (terms->term_count == MOST_TERMS) return NOT_HERE;
    terms->terms[terms->term_count++] = (Term){leaf, slope};
    return DONE;
}

/* Add what a value is known to be made of, `((leaf, slope), ...)`. */
static int add_terms(Terms *terms, PyObject *known, PyObject *is_exact, Slope rise)
{
    if (is_exact == Py_False) return NOT_AFFINE;
    if (is_exact != Py_True || rise.value == 0.0 || !PyTuple_CheckExact(known)) return NOT_HERE;
    int status = DONE;
    for (Py_ssize_t at = 0; status == DONE && at < PyTuple_GET_SIZE(known); at++) {
        PyObject *term = PyTuple_GET_ITEM(known, at);
        Slope slope;
        if (!PyTuple_CheckExact(term) || !as_slope(PyTuple_GET_ITEM(term, 1), &slope)) return NOT_HERE;
        status = add_term(terms, PyTuple_GET_ITEM(term, 0), slope, rise);
    }
    return status;
}

/* The slopes of an operation in its operands, as far as it is affine in them. */
static int slopes_of(const Record *record, Slope slopes[2])
{
    slopes[0] = slopes[1] = (Slope){1.0, 1};
    if (record->kind < OPERATOR) {
        if (record->form == negation) {
            slopes[0].value = -1.0;
            return DONE;
        }
        int is_affine = truth_of(record->form, AFFINE);
        return is_affine > 0 ? NOT_HERE : is_affine;
    }
    int side = SIDE_OF(record->kind);
    switch (OPERATOR_OF(record->kind)) {
    case ADD:
        return DONE;
    case SUBTRACT:
        slopes[side == BOTH].value = side == LEFT ? 1.0 : -1.0;
        return DONE;
    case MULTIPLY:
        if (side == BOTH) return NOT_AFFINE;
        return as_slope(record->second, &slopes[0]) ? DONE : NOT_HERE;
    case DIVIDE:
        if (side != LEFT) return NOT_AFFINE;
        if (!as_slope(record->second, &slopes[0]) || slopes[0].value == 0.0) return NOT_HERE;
        slopes[0] = (Slope){1.0 / slopes[0].value, 0};
        return DONE;
    default:
        return NOT_AFFINE;
    }
}

int find_terms(Terms *terms, PyObject *node)
{
    terms->term_count = terms->other_count = 0;
    Slope rise = {1.0, 1}, slopes[2];
    for (int count = 0; count < MOST_NODES; count++) {
        if (!IS_OURS(node)) return NOT_HERE;
        const Record *record = record_of(node);
        int status;
        if (record->form == source_form) {
            status = rise.value == 0.0 ? NOT_HERE : add_term(terms, node, (Slope){1.0, 1}, rise);
        } else if (record->form == affine_form) {
            status = add_terms(terms, record->first, record->second, rise);
        } else if (record->fold != NULL) {
            if (!is_record(record->fold)) return NOT_HERE;
            status = add_terms(terms, PyTuple_GET_ITEM(record->fold, 1), PyTuple_GET_ITEM(record->fold, 2), rise);
        } else if (record->kind == OTHER) {
            return NOT_HERE;
        } else {
            status = slopes_of(record, slopes);
            if (status != DONE) return status;
            if (!IS_SINGLE(record->kind)) {
                Slope other = rise;
                if (!multiply(&other, slopes[1])) return NOT_HERE;
                terms->others[terms->other_count++] = (Branch){record->second, other};
            }
            if (!multiply(&rise, slopes[0])) return NOT_HERE;
            node = record->first;
            continue;
        }
        if (status != DONE || terms->other_count == 0) return status;
        Branch next = terms->others[--terms->other_count];
        node = next.node;
        rise = next.rise;
    }
    return NOT_HERE;
}

static PyObject *number_of(Slope slope)
{
    return slope.is_whole ? PyLong_FromDouble(slope.value) : PyFloat_FromDouble(slope.value);
}

/* `((Source, its value, slope), ...)`; what the value's fold is goes into it. */
static PyObject *answer_of(const Terms *terms, PyObject *fold_terms)
{
    PyObject *answer = PyTuple_New(terms->term_count);
    for (int at = 0; answer != NULL && at < terms->term_count; at++) {
        PyObject *leaf = terms->terms[at].leaf, *slope = number_of(terms->terms[at].slope);
        PyObject *plain = slope ? plain_of(leaf) : NULL;
        PyObject *term = plain ? PyTuple_Pack(3, record_of(leaf)->first, plain, slope) : NULL;
        PyObject *fold_term = term ? PyTuple_Pack(2, leaf, slope) : NULL;
        Py_XDECREF(slope);
        Py_XDECREF(plain);
        if (fold_term == NULL) {
            Py_XDECREF(term);
            Py_CLEAR(answer);
        } else {
            PyTuple_SET_ITEM(answer, at, term);
            PyTuple_SET_ITEM(fold_terms, at, fold_term);
        }
    }
    return answer;
}

/* As `affine` in affine.py, which is asked where this does not know. */
PyObject *affine_terms(PyObject *module, PyObject *value)
{
    Terms terms;
    int status = IS_OURS(value) ? find_terms(&terms, value) : NOT_HERE;
    if (status == FAILED) return NULL;
    if (status == NOT_AFFINE) Py_RETURN_NONE;
    if (status == NOT_HERE) return PyObject_CallFunctionObjArgs(affine_of_python, value, NULL);
    for (int at = 0; at < terms.term_count; at++) Py_INCREF(terms.terms[at].leaf);
    PyObject *fold_terms = PyTuple_New(terms.term_count), *fold = NULL;
    PyObject *answer = fold_terms ? answer_of(&terms, fold_terms) : NULL;
    Record *record = record_of(value);
    if (answer != NULL && record->fold == NULL && record->form != source_form) {
        fold = PyTuple_Pack(3, affine_form, fold_terms, Py_True);
        if (fold == NULL) Py_CLEAR(answer);
        else Py_XSETREF(record->fold, Py_NewRef(fold));
    }
    for (int at = 0; at < terms.term_count; at++) Py_DECREF(terms.terms[at].leaf);
    Py_XDECREF(fold_terms);
    Py_XDECREF(fold);
    return answer;
}
