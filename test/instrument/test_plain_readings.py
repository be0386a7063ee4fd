"""Which expressions of a program count or decide."""

import ast

import pytest

from rosslt.instrument.plain_readings import plain_readings
from rosslt.instrument.tree_rewriting import bound_names


def found(text):
    """{text of an expression: what counts or decides by it}."""
    tree = ast.parse(text)
    taken = plain_readings(tree, bound_names(tree))
    return {ast.get_source_segment(text, node): taken[id(node)] for node in ast.walk(tree) if id(node) in taken}


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('for i in range(n): f(i)', {'n': 'range'}),
        ('def f():\n    return [i for i in range(1, self.n + 1)]', {'self.n + 1': 'range'}),
        ('x = [0.0] * n', {'n': 'the length of a list'}),
        ('x = n * [0.0]', {'n': 'the length of a list'}),
        ('import numpy as np\nx = np.zeros((n, 2), dtype=kind)', {'n': 'numpy.zeros'}),
        ('from numpy import linspace\nx = linspace(a, b, num=n)', {'n': 'numpy.linspace'}),
        ('import numpy as np\nx = np.arange(a, b, c, kind)', dict.fromkeys('abc', 'numpy.arange')),
        ('import numpy as np\nx = np.arange(start=a, stop=b, step=c)', dict.fromkeys('abc', 'numpy.arange')),
        ('import rospy\nrospy.Publisher(topic, kind, queue_size=n)', {'n': 'rospy.Publisher'}),
        ('if mode == 2 and not fast: f()', {'mode': 'if', 'fast': 'if'}),
        ('x = 1.0 if mode == 2 else 2.0', {'mode': 'if'}),
        ('while len(x) < n: x.append(0)', {'n': 'while'}),
        ('class A:\n    def __init__(self):\n        if mode: f()\nA()', {'mode': 'if'}),
        ('class A:\n    def run(self):\n        if mode: f()\nA().run()', {'mode': 'if'}),
        ('x = [1.0 if mode else 2.0 for _ in y]', {'mode': 'if'}),
    ],
)
def test_counts_and_decisions_are_found(text, expected):
    assert found(text) == expected


@pytest.mark.parametrize(
    'text',
    [
        'range = other\nfor i in range(n): f(i)',
        'from others import *\nfor i in range(n): f(i)',
        'for i in range(len(x)): f(i)',
        'for i in range(*n): f(i)',
        'x = y * n',
        'x = np.zeros(n)',
        'from mine import numpy as np\nx = np.zeros(n)',
        'import numpy as np\nimport mine as np\nx = np.zeros(n)',
        'import numpy as np\ndef f(np):\n    return np.zeros(n)',
        'if x is y: f()',
        'def f():\n    if mode == 2: g()',
        'def f():\n    if mode == 2: g()\nx = [f() for _ in y]',
        'def f():\n    if mode == 2: g()\n    yield\nx = f()',
        'x = (1.0 if mode else 2.0 for _ in y)',
        'class A(Thread):\n    def run(self):\n        if mode == 2: g()\nA().run()',
        '@known\nclass A:\n    def __init__(self):\n        if mode == 2: g()\nA()',
        'class A:\n    def __init__(self):\n        if mode == 2: g()\na = A()\ndef f(event): type(a)()',
        'while n > 0 and not rospy.is_shutdown():\n    rate.sleep()',
        '@njit\ndef f(n):\n    return [i for i in range(n)]',
    ],
)
def test_nothing_else_is(text):
    assert found(text) == {}
