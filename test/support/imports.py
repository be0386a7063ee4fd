"""The imports in the files of this package, as they stand in the text."""

import ast
import functools
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / 'src' / 'rosslt'
SCRIPTS = ROOT / 'scripts'


def python_files():
    scripts = [path for path in SCRIPTS.iterdir() if path.is_file() and is_python(path)]
    return sorted([*PACKAGE.rglob('*.py'), *scripts])


def is_python(path):
    with path.open('rb') as file:
        return path.suffix == '.py' or b'python' in file.readline()


@functools.lru_cache(maxsize=None)
def tree_of(path):
    return ast.parse(path.read_text(encoding='utf-8'), str(path))


def imports(path, nodes=None):
    """The absolute names that a file imports, or these nodes of it: modules, and names from modules."""
    package = ['rosslt', *path.relative_to(PACKAGE).parent.parts] if PACKAGE in path.parents else []
    for node in ast.walk(tree_of(path)) if nodes is None else nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = '.'.join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield node.lineno, module + '.' + alias.name
