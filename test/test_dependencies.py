"""Holds that what the package imports and launches is installed: by `./run`, and by what reads package.xml."""

import ast
import re
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from support.imports import PACKAGE, ROOT, imports, python_files, tree_of

#: What package.xml calls the packages of modules that ROS does not have; a ROS package is called as its module.
KEYS = {
    'numpy': 'python3-numpy',
    'rospkg': 'python3-rospkg',
    'scipy': 'python3-scipy',
    'yaml': 'python3-yaml',
}
#: The Debian packages of executables that are called neither as their ROS package nor ros-*.
DEBIAN = {'rosbag': {'python3-rosbag'}}
PAGE = PACKAGE / 'web'
#: What the page alone imports: viser, and packages that it brings along.
FROM_VISER = {'trimesh', 'viser', 'websockets'}
REPLACED = PACKAGE / 'instrument' / 'routing.py'  # it replaces modules that a node has imported


class Needed(ast.NodeVisitor):
    """Nodes of a tree that import, but for those that go on without what they import."""

    def __init__(self, tree):
        self.nodes = []
        self.visit(tree)

    def visit_Try(self, node):
        if not any(handler.type and 'ImportError' in ast.dump(handler.type) for handler in node.handlers):
            self.generic_visit(node)

    def visit_With(self, node):
        if not any('ImportError' in ast.dump(item.context_expr) for item in node.items):
            self.generic_visit(node)

    def generic_visit(self, node):
        if isinstance(node, (ast.Import, ast.ImportFrom, ast.Call)):
            self.nodes.append(node)
        super().generic_visit(node)


def needed(path):
    """The modules beside Python's own that a file cannot do without, each with a line that imports it."""
    nodes = Needed(tree_of(path)).nodes
    found = list(imports(path, nodes))
    for node in nodes:
        called = isinstance(node, ast.Call) and (getattr(node.func, 'attr', None) or getattr(node.func, 'id', None))
        if called in ('import_module', '__import__') and isinstance(node.args[0], ast.Constant):
            found.append((node.lineno, node.args[0].value))
    modules = {}
    for line, name in found:
        module = name.split('.')[0]
        if module and module not in sys.stdlib_module_names | {'rosslt'}:
            modules.setdefault(module, '{}:{}'.format(path.relative_to(ROOT), line))
    if path == REPLACED:
        for replaced in re.findall(r"@replace_module\('(\w+)", path.read_text(encoding='utf-8')):
            modules.pop(replaced, None)
    return modules


def launched():
    """The ROS packages that launch files name, each with a file that does."""
    found = {}
    for path in sorted((ROOT / 'launch').iterdir()):
        for name in re.findall(r'\bpkg="([^"]+)"|\bfind[ (]+[\'"]?(\w+)', path.read_text(encoding='utf-8')):
            found.setdefault(''.join(name), str(path.relative_to(ROOT)))
    found.pop('rosslt')
    return found


def manifest():
    """What package.xml wants where the package runs."""
    root = ElementTree.parse(ROOT / 'package.xml').getroot()
    return {element.text for tag in ('depend', 'exec_depend') for element in root.iter(tag)}


def list_of_run(name):
    """A list at the top of ./run, as bash expands it."""
    text = (ROOT / 'run').read_text(encoding='utf-8')
    definition = re.search(r'^{}=\([^()]*?\)$'.format(name), text, flags=re.MULTILINE).group()
    script = '{}; printf "%s\\n" "${{{}[@]}}"'.format(definition, name)
    return subprocess.run(['bash', '-c', script], stdout=subprocess.PIPE, encoding='utf-8', check=True).stdout.split()


def installed():
    """What ./run installs where the package runs: always, and where there is a display."""
    return {*list_of_run('runtime_packages'), *list_of_run('display_packages')}


@pytest.mark.skipif(sys.version_info < (3, 10), reason='sys.stdlib_module_names came with Python 3.10')
def test_what_is_imported_is_installed():
    missing = []
    for path in python_files():
        for module, where in needed(path).items():
            if module in FROM_VISER and PAGE in path.parents:
                continue
            if KEYS.get(module, module) not in manifest():
                missing.append('{}: package.xml has no exec_depend for {}'.format(where, module))
            package = 'python3-' + module.lower().replace('_', '-')
            if package not in installed():
                missing.append('{}: ./run does not install {} to run with'.format(where, package))
    assert not missing, '\n'.join(missing)


def test_what_is_launched_is_installed():
    def is_there(name):
        packages = DEBIAN.get(name, {name, 'ros-' + name.replace('_', '-')})
        return name in manifest() and not installed().isdisjoint(packages)

    assert {name: file for name, file in launched().items() if not is_there(name)} == {}


def test_what_the_page_needs_is_installed_with_it():
    assert any(requirement.startswith('viser==') for requirement in list_of_run('page_requirements'))
    assert {module for path in PAGE.rglob('*.py') for module in needed(path)} >= FROM_VISER
