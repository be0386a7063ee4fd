"""Holds the direction of the imports between the rooms, as docs/design.md lists them."""

import ast
import functools
import re
import subprocess
import sys

import pytest

from support.imports import PACKAGE, ROOT, imports, python_files, tree_of

GENERATED = {'msg', 'srv'}
PUBLIC_DOORS = {'tf.py': ['rosslt', 'node', 'tf']}  # beside the package's own door: a folder that each opens
LONGEST_FILE = 500  # lines; most fit a screen or three


def rooms():
    """The names of the rooms, from the top down: the first column of the table in docs/design.md."""
    section = (ROOT / 'docs' / 'design.md').read_text(encoding='utf-8').split('\n## The rooms\n')[1]
    return re.findall(r'^\| `(\w+)`', section.split('\n## ')[0], flags=re.MULTILINE)


def room_of(path):
    """The room that a file is in; None for the package's own door and for scripts."""
    parts = path.relative_to(PACKAGE).parts if PACKAGE in path.parents else ()
    return parts[0] if len(parts) > 1 else None


def faults(path):
    """What a file imports although it must not, each as a line to read."""
    order = rooms()
    room = room_of(path)
    if room is not None and room not in order:
        yield '{}: docs/design.md lists no room {}'.format(path.relative_to(ROOT), room)
        return
    for line, name in imports(path):
        where = '{}:{}: {}'.format(path.relative_to(ROOT), line, name)
        parts = name.split('.')
        if parts[0] != 'rosslt':
            if room == 'values' and parts[0] not in sys.stdlib_module_names | {'numpy', 'scipy'}:
                yield where + ': values imports nothing but the standard library, NumPy and SciPy'
            if room == 'messages' and parts[0] == 'rospy':
                yield where + ': messages does not need a running ROS'
            continue
        target = parts[1] if len(parts) > 1 else None
        if target in GENERATED:
            if room == 'values':
                yield where + ': values imports no ROS'
            continue
        if room is not None and target not in order:
            yield where + ": the package's own door is above every room"
        elif room is not None and order.index(target) < order.index(room):
            yield where + ': {} is above {}'.format(target, room)
        elif parts[:3] == PUBLIC_DOORS.get(path.name) and path.parent == PACKAGE:
            continue
        elif target in order and target != room and reaches_past_the_door(parts):
            yield where + ': reaches past the door of {}'.format(target)


def reaches_past_the_door(parts):
    """Whether the third part of rosslt.room.part is a module of that room, and no name that its door offers.

    An executable may start the main() of a module: that is a door for people.
    """
    if parts[3:] == ['main'] or len(parts) < 3 or parts[2] in offered_by(PACKAGE / parts[1] / '__init__.py'):
        return False
    inside = PACKAGE.joinpath(*parts[1:3])
    return inside.is_dir() or inside.with_suffix('.py').is_file()


@functools.lru_cache(maxsize=None)
def offered_by(door):
    """The names that a door takes from the modules behind it."""
    return {
        alias.asname or alias.name
        for node in ast.walk(tree_of(door))
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def test_every_room_is_in_the_list_and_has_a_door():
    there = {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name != '__pycache__'}
    assert there == set(rooms())
    for room in there:
        door = PACKAGE / room / '__init__.py'
        assert ast.get_docstring(tree_of(door)), '{} does not say what the room is for'.format(door)


@pytest.mark.skipif(sys.version_info < (3, 10), reason='sys.stdlib_module_names came with Python 3.10')
def test_imports_point_down_the_list_and_stop_at_the_doors():
    found = [fault for path in python_files() for fault in faults(path)]
    assert not found, '\n'.join(found)


def module_files(path):
    """The files of this package that a file imports by name: modules, and packages whose doors it uses."""
    for _, name in imports(path):
        parts = name.split('.')
        if parts[0] != 'rosslt':
            continue
        while len(parts) > 1:
            found = PACKAGE.joinpath(*parts[1:])
            if found.with_suffix('.py').is_file():
                yield found.with_suffix('.py')
                break
            if (found / '__init__.py').is_file():
                yield found / '__init__.py'
                break
            parts.pop()


def test_no_file_imports_itself_by_way_of_others():
    imported = {path: set(module_files(path)) - {path} for path in sorted(PACKAGE.rglob('*.py'))}
    while True:
        done = {path for path, others in imported.items() if not others & imported.keys()}
        if not done:
            break
        for path in done:
            del imported[path]
    assert not imported, 'these import each other: ' + ', '.join(str(path.relative_to(ROOT)) for path in imported)


def test_every_comparison_with_a_tolerance_is_explained():
    section = (ROOT / 'docs' / 'design.md').read_text(encoding='utf-8').split('\n## Close enough\n')[1]
    listed = set(re.findall(r'^\| `([\w/]+\.py)`', section.split('\n## ')[0], flags=re.MULTILINE))
    there = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob('*.py')
        if re.search(r'\b(isclose|allclose)\(', path.read_text(encoding='utf-8'))
    }
    assert there <= listed, 'docs/design.md does not say why they compare with a tolerance of their own'
    assert all((PACKAGE / name).is_file() for name in listed)


def test_every_file_is_short():
    files = [*python_files(), *PACKAGE.rglob('*.[ch]')]
    assert [path for path in files if len(path.read_text(encoding='utf-8').splitlines()) > LONGEST_FILE] == []


def test_the_part_that_needs_no_ros_runs_without_it():
    program = """
import sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] in ('rospy', 'genpy', 'genmsg', 'roslib', 'rosgraph', 'rospkg', 'catkin_pkg'):
            raise ImportError('there is no ' + name)

sys.meta_path.insert(0, NoRos())
import rosslt
import rosslt.math
x = rosslt.track(2.0, rosslt.Source('/node', 1))
assert list(rosslt.solve(3 * x, 12.0).values()) == [4.0]
"""
    result = subprocess.run(
        [sys.executable, '-c', program],
        env={'PYTHONPATH': str(PACKAGE.parent)},
        stderr=subprocess.PIPE,
        encoding='utf-8',
        timeout=60,
        check=False,
    )
    assert result.returncode == 0, result.stderr


def module_of(name):
    """The file of a module, or of the module that a name is in; None outside the package."""
    parts = name.split('.')[1:]
    for end in (len(parts), len(parts) - 1):
        base = PACKAGE.joinpath(*parts[:end])
        for path in (base.with_suffix('.py'), base / '__init__.py'):
            if name.startswith('rosslt.') and end > 0 and path.is_file():
                return path
    return None


def imported_files(path):
    """The files that a file imports, also while it runs: by `import_module` with a name beginning with a point."""
    package = ['rosslt', *path.relative_to(PACKAGE).parent.parts]
    names = [name for _, name in imports(path)]
    for node in ast.walk(tree_of(path)):
        is_import = isinstance(node, ast.Call) and getattr(node.func, 'attr', '') == 'import_module'
        if is_import and isinstance(node.args[0], ast.Constant) and node.args[0].value.startswith('.'):
            up = len(node.args[0].value) - len(node.args[0].value.lstrip('.'))
            names.append('.'.join([*package[: len(package) - up + 1], node.args[0].value.lstrip('.')]))
    return {found for found in map(module_of, names) if found is not None}


def circles(edges):
    """What is left of `{file: imported files}` when all are taken away that import nothing of what is left."""
    left = dict(edges)
    while True:
        ends = [path for path, found in left.items() if not (found - {path}) & left.keys()]
        if not ends:
            return left
        for path in ends:
            del left[path]


def test_files_of_values_import_each_other_in_one_direction():
    left = circles({path: imported_files(path) for path in (PACKAGE / 'values').rglob('*.py')})
    assert not left


def test_circle_of_files_is_found():
    assert circles({'a': {'b'}, 'b': {'c'}, 'c': {'a'}, 'd': {'a'}, 'e': set()}).keys() == {'a', 'b', 'c', 'd'}
