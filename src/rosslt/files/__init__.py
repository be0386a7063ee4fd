"""The room of text files: how is one value in a file changed, and nobody's edit lost?

It may import the room `values`. `python_numbers` finds the literals of a Python text, `source_text` replaces them and
follows them through edits, `yaml_text` and `launch_text` do so for YAML and launch files; `notation` writes a value in
the manner of the one before. `replacing` reads and replaces files as a whole, `transaction` several of them, and
`watching` notices what others write.
"""

from typing import TYPE_CHECKING, Any

from rosslt.files.errors import FileError
from rosslt.files.launch_text import ORIGINS, ParamChange, param_edits
from rosslt.files.notation import alike, equal, in_manner_of, is_scalar
from rosslt.files.python_numbers import LITERALS, Number, numbers_in, without_numbers
from rosslt.files.replacing import (
    Unsettled,
    holds,
    overwrite,
    read,
    read_bytes,
    read_settled,
    read_settled_bytes,
    replace,
    replace_bytes,
)
from rosslt.files.source_text import (
    Edit,
    SourceText,
    as_they_read,
    changed_elsewhere,
    digest_of,
    followed,
    replaced,
    respelled,
)
from rosslt.files.transaction import unified_diff, write
from rosslt.files.watching import FileWatch

if TYPE_CHECKING:
    from rosslt.files.inline_yaml import inline_edits
    from rosslt.files.yaml_text import YamlChange, yaml_edits

__all__ = [
    'LITERALS',
    'ORIGINS',
    'Edit',
    'FileError',
    'Number',
    'SourceText',
    'Unsettled',
    'ParamChange',
    'FileWatch',
    'YamlChange',
    'alike',
    'as_they_read',
    'changed_elsewhere',
    'digest_of',
    'equal',
    'followed',
    'holds',
    'in_manner_of',
    'inline_edits',
    'is_scalar',
    'numbers_in',
    'overwrite',
    'param_edits',
    'read',
    'read_bytes',
    'read_settled',
    'read_settled_bytes',
    'replace',
    'replace_bytes',
    'replaced',
    'respelled',
    'unified_diff',
    'without_numbers',
    'write',
    'yaml_edits',
]


def __getattr__(name: str) -> Any:
    # Only those who use it wait for YAML.
    if name == 'inline_edits':
        from rosslt.files.inline_yaml import inline_edits

        return inline_edits
    if name in ('YamlChange', 'yaml_edits'):
        from rosslt.files import yaml_text

        return getattr(yaml_text, name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
