"""Programs for the tests of the room `instrument`: their literals, and the results of running them rewritten."""

import ast
import itertools

from rosslt.instrument import loader, routing
from rosslt.instrument.literals import SourceText, find_literals
from rosslt.instrument.states import find_states
from rosslt.instrument.tree_rewriting import rewrite


def literals_of(text):
    """The literals of a program that are locations, in their order."""
    source = SourceText('/nowhere/program.py', text.encode('utf-8'))
    tree = ast.parse(text)
    return [literal for _, literal in find_literals(tree, source, find_states(tree))]


def verdict_of(text):
    """The first literal of a program."""
    return literals_of(text)[0]


_numbers = itertools.count()


def run_rewritten(text, path=None, module='program'):
    """The names of a program after it has run rewritten, in this process."""
    assert routing.ROSPY is not None
    # What has the path of another one would be that one, edited.
    path = path or f'/nowhere/{next(_numbers)}/program.py'
    made = rewrite(text.encode('utf-8'), path, path)
    names = {'__name__': module, '__file__': path}
    loader.prepare(names, made, path)
    exec(made.code, names)
    return names
