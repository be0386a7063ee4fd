"""Random programs of NumPy's functions: what a program does depends on its seed and on shapes, never on the numbers."""

import random

import numpy

SHAPES = ((), (1,), (3,), (1, 3), (3, 1), (3, 3), (2, 3), (2, 2, 2))
"""The shapes of the arrays that a program begins with."""


UNARY = (
    'sin cos tanh arctan abs negative square exp sqrt sign floor ceil rint sort ravel transpose flip cumsum '
    'positive nan_to_num squeeze atleast_2d diff fix i0 sinc conjugate reciprocal log1p cumprod'
)
BINARY = (
    'add subtract multiply divide maximum minimum fmax fmin hypot fmod remainder heaviside '
    'logaddexp floor_divide dot inner outer kron matmul convolve cross vdot append logaddexp2 float_power'
)
REDUCTIONS = 'sum mean max min std var median prod ptp nansum nanmax cumsum average'
METHODS = 'sum mean max min std var prod cumsum ptp'


def _mask(r, a):
    return numpy.array([r.random() < 0.5 for _ in range(a.size)], bool).reshape(a.shape)


def _axis(r, a):
    return r.choice([None, *range(a.ndim)])


def _square(n, a):
    """A matrix that can be inverted, made of any numbers."""
    flat = n.resize(n.ravel(a), 4).reshape(2, 2)
    return n.tanh(flat) + 3 * n.eye(2)


#: Functions of the random generator, the module and two arrays.
CALLS = [
    *[lambda r, n, a, b, name=name: getattr(n, name)(a) for name in UNARY.split()],
    *[lambda r, n, a, b, name=name: getattr(n, name)(a, b) for name in BINARY.split()],
    *[lambda r, n, a, b, name=name: getattr(n, name)(a, axis=_axis(r, a)) for name in REDUCTIONS.split()],
    *[lambda r, n, a, b, name=name: getattr(a, name)(axis=_axis(r, a)) for name in METHODS.split()],
    lambda r, n, a, b: a + b * 2,
    lambda r, n, a, b: n.arctan2(a, 1 + b * b),
    lambda r, n, a, b: 1 / (1 + a * a),
    lambda r, n, a, b: 0.5 * a - b / 3,
    lambda r, n, a, b: a**2 % 1.5,
    lambda r, n, a, b: abs(-a) // 0.25,
    lambda r, n, a, b: a @ b,
    lambda r, n, a, b: a[..., 0],
    lambda r, n, a, b: a[::-1],
    lambda r, n, a, b: a[0],
    lambda r, n, a, b: a[-1, ...],
    lambda r, n, a, b: a[[0, -1]],
    lambda r, n, a, b: n.asarray(a)[_mask(r, a)],
    lambda r, n, a, b: a.T.copy(),
    lambda r, n, a, b: a.reshape(-1),
    lambda r, n, a, b: n.where(_mask(r, a), a, b),
    lambda r, n, a, b: n.clip(a, -0.5, b),
    lambda r, n, a, b: n.round(a, 1),
    lambda r, n, a, b: n.roll(a, 1),
    lambda r, n, a, b: n.tile(a, 2),
    lambda r, n, a, b: n.concatenate([a, b]),
    lambda r, n, a, b: n.stack([a, b]),
    lambda r, n, a, b: n.vstack([a, b]),
    lambda r, n, a, b: n.hstack([a, b]),
    lambda r, n, a, b: n.diag(a),
    lambda r, n, a, b: n.trace(a),
    lambda r, n, a, b: n.interp(a, [-2.0, 0.0, 2.0], [1.0, -1.0, 4.0]),
    lambda r, n, a, b: n.interp(0.3, n.sort(n.ravel(a)), n.resize(b, a.size)),
    lambda r, n, a, b: n.percentile(a, 30, axis=_axis(r, a)),
    lambda r, n, a, b: n.gradient(a),
    lambda r, n, a, b: n.unwrap(3 * a),
    lambda r, n, a, b: n.polyval(n.ravel(a)[:3], 0.5),
    lambda r, n, a, b: n.cov(a),
    lambda r, n, a, b: n.corrcoef(a, b),
    lambda r, n, a, b: n.array([a[0], 1.0, b[-1]]),
    lambda r, n, a, b: n.linspace(a, b, 3),
    lambda r, n, a, b: n.full(a.shape, b[0]),
    lambda r, n, a, b: n.add.reduce(a, axis=0),
    lambda r, n, a, b: n.maximum.accumulate(a),
    lambda r, n, a, b: n.multiply.outer(a, b),
    lambda r, n, a, b: n.sum(a, where=_mask(r, a), initial=0.5),
    lambda r, n, a, b: n.tensordot(a, b, 1),
    lambda r, n, a, b: n.einsum('...i,...i->...', a, b),
    lambda r, n, a, b: n.einsum('ij,ij->j', a, b),
    lambda r, n, a, b: n.einsum('ij,jk', a, b),
    lambda r, n, a, b: n.einsum('i,j->ji', a, b),
    lambda r, n, a, b: n.einsum('ii->i', a),
    lambda r, n, a, b: n.linalg.inv(_square(n, a)),
    lambda r, n, a, b: n.linalg.det(_square(n, a)),
    lambda r, n, a, b: n.linalg.solve(_square(n, a), n.resize(b, 2)),
    lambda r, n, a, b: n.linalg.matrix_power(_square(n, a), r.choice([2, 3, -1])),
    lambda r, n, a, b: n.linalg.norm(a, axis=_axis(r, a)),
    lambda r, n, a, b: n.linalg.norm(a, r.choice([1, 2, numpy.inf])),
    lambda r, n, a, b: n.linalg.svd(a)[1],
    lambda r, n, a, b: n.linalg.eigvalsh(_square(n, a) @ _square(n, a).T),
    lambda r, n, a, b: n.linalg.qr(_square(n, a))[1],
    lambda r, n, a, b: n.linalg.pinv(_square(n, a)),
    lambda r, n, a, b: n.linalg.cholesky(_square(n, a) @ _square(n, a).T),
    lambda r, n, a, b: n.ravel(a)[0].sum(axis=None) + n.ravel(b)[-1].round(decimals=1),
    lambda r, n, a, b: n.ravel(a)[0].max(axis=None) * n.ravel(a)[0].mean(dtype=float),
]


def _plus(r, n, a, b):
    a += b


def _times(r, n, a, b):
    part = a[..., :1]
    part *= 1.5


def _set(r, n, a, b):
    a[_mask(r, a)] = b.ravel()[0]


def _part(r, n, a, b):
    a[0] = b


def _flat(r, n, a, b):
    a.flat = b


#: Functions of the same that write to the first array.
WRITERS = [
    _plus,
    _times,
    _set,
    _part,
    _flat,
    lambda r, n, a, b: a.sort(),
    lambda r, n, a, b: a.partition(1),
    lambda r, n, a, b: a.fill(b.ravel()[0]),
    lambda r, n, a, b: a.itemset(0, b.ravel()[0]),
    lambda r, n, a, b: a.put([0], b),
    lambda r, n, a, b: n.put(a, [0, -1], b),
    lambda r, n, a, b: n.fill_diagonal(a, b.ravel()[0]),
    lambda r, n, a, b: n.fill_diagonal(a, 5.0),
    lambda r, n, a, b: n.putmask(a, _mask(r, a), b),
    lambda r, n, a, b: n.place(a, _mask(r, a), b.ravel()),
    lambda r, n, a, b: n.copyto(a, b, where=_mask(r, a)),
    lambda r, n, a, b: n.copyto(a, 2.0, where=_mask(r, a)),
    lambda r, n, a, b: n.put_along_axis(a, numpy.zeros((1,) * a.ndim, int), 3.0, 0),
    lambda r, n, a, b: n.add.at(a, [0, 0], 1.0),
    lambda r, n, a, b: n.multiply(a, 2, out=a, where=_mask(r, a)),
    lambda r, n, a, b: n.multiply(b, 2, out=a),
    lambda r, n, a, b: n.subtract(a, b, out=a),
    lambda r, n, a, b: n.maximum(a, b, out=a, where=_mask(r, a)),
    lambda r, n, a, b: n.clip(b, -0.5, 0.5, out=a),
    lambda r, n, a, b: n.sum(b, axis=0, out=a),
]


def begin(seed):
    """The numbers that a program begins with, and others that they may become."""
    r = random.Random(seed)
    shapes = [r.choice(SHAPES) for _ in range(3)]
    return [[[r.uniform(-2, 2) for _ in range(int(numpy.prod(shape)))] for shape in shapes] for _ in range(2)], shapes


def run(n, arrays, seed, carry=lambda result: result):
    """The results of the steps of a program: arrays and numbers, or the class of what a step raises.

    Args:
        carry: makes of each result the one that later steps get.
    """
    r, known, results = random.Random(seed), list(arrays), []
    for _ in range(r.randint(2, 6)):
        a, b, is_writer, part = r.choice(known), r.choice(known), r.random() < 0.3, random.Random(r.random())
        try:
            if is_writer:
                made = n.zeros(numpy.shape(a))
                made[...] = a
                part.choice(WRITERS)(part, n, made, b)
            else:
                made = part.choice(CALLS)(part, n, a, b)
        except Exception as error:
            results.append(type(error))
            continue
        for one in made if type(made) in (list, tuple) else [made]:
            if getattr(one, 'size', 100) < 100:
                known.append(carry(n.asarray(one) if r.random() < 0.8 else one))
                results.append(one)
    return results
