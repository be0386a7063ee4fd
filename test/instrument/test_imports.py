"""However a node imports what keeps provenance, it gets that: each way in a program of its own."""

import dynamic_reconfigure.server
import pytest

from support import fork_server
from support.programs import run_rewritten

IMPORTS = {
    'a function of numpy': ('from numpy import sin', 'sin(x)'),
    'a maker of arrays': ('from numpy import array', 'array([x, 1.0])[0]'),
    'all of numpy': ('from numpy import *', 'clip(x, 0.0, 9.0)'),
    'a function of numpy.linalg': ('from numpy.linalg import norm', 'norm([x, 1.0])'),
    'numpy.linalg by another name': ('import numpy.linalg as la', 'la.norm([x, 1.0])'),
    'numpy.linalg from numpy': ('from numpy import linalg', 'linalg.norm([x, 1.0])'),
    'a function of tf.transformations': (
        'from tf.transformations import quaternion_from_euler',
        'quaternion_from_euler(0, 0, x)[2]',
    ),
    'tf.transformations from tf': ('from tf import transformations as t', 't.quaternion_from_euler(0, 0, x)[2]'),
    'tf.transformations by its full name': (
        'import tf.transformations',
        'tf.transformations.rotation_matrix(x, [0, 0, 1])[0][0]',
    ),
    'tf.transformations from tf_conversions': (
        'import tf_conversions',
        'tf_conversions.transformations.quaternion_from_euler(0, 0, x)[2]',
    ),
    'a function of tf.transformations from tf_conversions': (
        'from tf_conversions import transformations',
        'transformations.quaternion_from_euler(0, 0, x)[2]',
    ),
    'a function of math': ('from math import sin', 'sin(x)'),
}

RUN = """
import sys
sys.path.insert(0, {tests!r})
from rosslt import values
from support.programs import run_rewritten
assert values.is_tracked(run_rewritten({program!r})['y'])
"""


@pytest.mark.parametrize(('line', 'formula'), IMPORTS.values(), ids=IMPORTS)
def test_what_is_imported_keeps_provenance(line, formula, request, tmp_path):
    program = f'{line}\nx = 0.5\ny = {formula}\n'
    script = tmp_path / 'imports.py'
    script.write_text(RUN.format(tests=str(request.config.rootpath / 'test'), program=program))
    ran = fork_server.call(str(script), [], 60)
    assert ran.returncode == 0, ran.stderr


def test_a_module_in_a_package_is_the_tracked_one_however_it_is_named():
    program = """
import dynamic_reconfigure.server
from dynamic_reconfigure.server import Server
from dynamic_reconfigure import server
servers = dynamic_reconfigure.server.Server, Server, server.Server
"""
    first, *others = run_rewritten(program)['servers']
    assert issubclass(first, dynamic_reconfigure.server.Server)
    assert first is not dynamic_reconfigure.server.Server
    assert all(other is first for other in others)
