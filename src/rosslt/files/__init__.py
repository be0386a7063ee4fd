"""The room of text files: how is one value in a file changed, and nobody's edit lost?

It may import the room `values`. `python_literals` finds the literals of a Python text, `python_source` replaces them
and follows them through edits, `yaml_text` and `launch_text` do so for YAML and launch files, and `urdf_text` for
robots; `notation` writes a value in the manner of the one before. `rows` does what people do with rows of lists, which
`python_rows` and `yaml_rows` find. `atomic_replacement` reads and replaces files as a whole, `transaction` several of
them, and `watching` notices what others write.
"""

from rosslt.files.atomic_replacement import Unsettled, holds, overwrite, read_bytes, read_settled_bytes, replace_bytes
from rosslt.files.errors import FileError
from rosslt.files.inline_yaml import inline_edits, inline_places, inline_row_additions, inline_row_edits
from rosslt.files.launch_text import ORIGINS, AttributeChange, attribute_edits, attribute_places, attribute_text, words
from rosslt.files.notation import alike, equal, in_manner_of, is_scalar, notations
from rosslt.files.python_literals import LITERALS, Literal, Positions
from rosslt.files.python_rows import RowEdits, python_row_additions, python_row_edits, rows_of_numbers
from rosslt.files.python_source import (
    Edit,
    Followed,
    SourceText,
    Standing,
    changed_elsewhere,
    digest_of,
    followed,
    replaced,
)
from rosslt.files.rows import DELETE, DOWN, DUPLICATE, OPERATIONS, UP, index_after, index_before
from rosslt.files.transaction import beside, taking_back, unified_diff, write
from rosslt.files.urdf_text import (
    UrdfChange,
    UrdfNumber,
    alike_beside,
    urdf_edits,
    urdf_numbers,
    urdf_places,
    with_numbers,
)
from rosslt.files.watching import FileWatch
from rosslt.files.yaml_rows import yaml_row_additions, yaml_row_edits
from rosslt.files.yaml_text import YamlChange, yaml_edits, yaml_places
