/* Which step removes the residuals of a system? `shortest_step` of `solve/least_squares.py` with `elimination.py`, on
   doubles, in the same order of operations. */

#include "core.h"

/* Gaussian elimination with pivots and one right side, which gets the solution: 0 if the matrix is singular. */
static int solve_system(double *matrix, double *right, Py_ssize_t size)
{
    for (Py_ssize_t column = 0; column < size; column++) {
        Py_ssize_t pivot = column;
        for (Py_ssize_t at = column + 1; at < size; at++) {
            if (fabs(matrix[at * size + column]) > fabs(matrix[pivot * size + column])) pivot = at;
        }
        double *head = matrix + column * size, swapped;
        if (pivot != column) {
            double *other = matrix + pivot * size;
            for (Py_ssize_t at = 0; at < size; at++) swapped = head[at], head[at] = other[at], other[at] = swapped;
            swapped = right[column], right[column] = right[pivot], right[pivot] = swapped;
        }
        if (head[column] == 0.0) return 0;
        for (Py_ssize_t at = column + 1; at < size; at++) {
            double *row = matrix + at * size;
            if (row[column] == 0.0) continue;
            double factor = row[column] / head[column];
            for (Py_ssize_t place = column + 1; place < size; place++) row[place] = row[place] - factor * head[place];
            right[at] = right[at] - factor * right[column];
        }
    }
    for (Py_ssize_t at = size - 1; at >= 0; at--) {
        const double *row = matrix + at * size;
        for (Py_ssize_t place = at + 1; place < size; place++) {
            if (row[place] != 0.0) right[at] = right[at] - row[place] * right[place];
        }
        if (right[at] != 0.0) right[at] = right[at] / row[at];
    }
    return 1;
}

/* A list of floats as doubles: 0 if there is something else. */
static int take_doubles(PyObject *list, double *numbers)
{
    for (Py_ssize_t at = 0; at < PyList_GET_SIZE(list); at++) {
        if (!as_double(PyList_GET_ITEM(list, at), numbers + at)) return 0;
    }
    return 1;
}

/* Fill a matrix with scaled slopes: 0 if there is something else. */
static int take_rows(PyObject *rows, const double *scales, Py_ssize_t width, double *matrix)
{
    for (Py_ssize_t at = 0; at < PyList_GET_SIZE(rows); at++) {
        PyObject *place, *slope;
        Py_ssize_t position = 0;
        while (PyDict_Next(PyList_GET_ITEM(rows, at), &position, &place, &slope)) {
            Py_ssize_t column = PyLong_AsSsize_t(place);
            double number;
            if (column < 0 || column >= width || !as_double(slope, &number)) return 0;
            matrix[at * width + column] = number * scales[column];
        }
    }
    return 1;
}

/* Divide each row by its length, or all by that of all, and what is missing likewise: 0 if a length is out of the range
   whose squares are floats. */
static int weigh(double *matrix, double *missing, Py_ssize_t height, Py_ssize_t width, double *lengths, int by_row)
{
    double total = 0.0;
    for (Py_ssize_t at = 0; at < height; at++) {
        double sum = 0.0;
        const double *row = matrix + at * width;
        for (Py_ssize_t place = 0; place < width; place++) sum += row[place] * row[place];
        lengths[at] = sqrt(sum);
        if (!(lengths[at] > 1e-150 && lengths[at] < 1e150)) return 0;
        total += lengths[at] * lengths[at];
    }
    for (Py_ssize_t at = 0; at < height; at++) {
        double length = by_row ? lengths[at] : sqrt(total);
        for (Py_ssize_t place = 0; place < width; place++) matrix[at * width + place] /= length;
        missing[at] /= length;
    }
    return 1;
}

PyObject *shortest_step(PyObject *module, PyObject *args)
{
    PyObject *rows, *of_missing, *of_scales, *result = NULL;
    double damping;
    int by_row;
    if (!PyArg_ParseTuple(args, "O!O!O!dp:shortest_step", &PyList_Type, &rows, &PyList_Type, &of_missing, &PyList_Type,
                          &of_scales, &damping, &by_row)) {
        return NULL;
    }
    Py_ssize_t height = PyList_GET_SIZE(rows), width = PyList_GET_SIZE(of_scales), count = 0;
    Py_ssize_t least = height < width ? height : width;
    Py_ssize_t room = height * width + 2 * height + 3 * width + least * least + 1;
    double *matrix = PyMem_Calloc((size_t)room, sizeof(double));
    Py_ssize_t *used = PyMem_Calloc((size_t)width + 1, sizeof(Py_ssize_t));
    if (matrix == NULL || used == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    double *missing = matrix + height * width, *lengths = missing + height, *scales = lengths + height,
           *step = scales + width, *right = step + width, *square = right + width;
    if (PyList_GET_SIZE(of_missing) != height || !take_doubles(of_missing, missing) ||
        !take_doubles(of_scales, scales) || !take_rows(rows, scales, width, matrix) ||
        !weigh(matrix, missing, height, width, lengths, by_row)) {
        if (!PyErr_Occurred()) result = Py_NewRef(Py_NotImplemented);
        goto done;
    }
    for (Py_ssize_t place = 0; place < width; place++) {
        for (Py_ssize_t at = 0; at < height; at++) {
            if (matrix[at * width + place] == 0.0) continue;
            used[count++] = place;
            break;
        }
    }
    int is_wide = height <= count;
    Py_ssize_t size = is_wide ? height : count, length = is_wide ? count : height;
#define PART(one, along) (is_wide ? matrix[(one) * width + used[along]] : matrix[(along) * width + used[one]])
    for (Py_ssize_t one = 0; one < size; one++) {
        for (Py_ssize_t other = 0; other < size; other++) {
            double sum = 0.0;
            for (Py_ssize_t along = 0; along < length; along++) sum += PART(one, along) * PART(other, along);
            square[one * size + other] = one == other ? sum + damping : sum;
        }
        if (is_wide) continue;
        for (Py_ssize_t along = 0; along < height; along++) {
            if (PART(one, along) != 0.0) right[one] += PART(one, along) * missing[along];
        }
    }
    if (!solve_system(square, is_wide ? missing : right, size)) {
        PyErr_SetString(PyExc_ZeroDivisionError, "Singular matrix");
        goto done;
    }
    for (Py_ssize_t at = 0; at < count; at++) {
        double part = is_wide ? 0.0 : right[at];
        for (Py_ssize_t row = 0; is_wide && row < height; row++) {
            if (PART(row, at) != 0.0) part += PART(row, at) * missing[row];
        }
        step[used[at]] = part * scales[used[at]];
    }
#undef PART
    result = PyList_New(width);
    for (Py_ssize_t at = 0; result != NULL && at < width; at++) {
        PyObject *number = PyFloat_FromDouble(step[at]);
        if (number == NULL) Py_CLEAR(result);
        else PyList_SET_ITEM(result, at, number);
    }
done:
    PyMem_Free(matrix);
    PyMem_Free(used);
    return result;
}
