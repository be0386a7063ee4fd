"""Rows added to lists in YAML and launch files, and every other byte as it was."""

import re

import pytest

from rosslt.files import FileError, inline_row_additions, replaced, yaml_row_additions

IN_BLOCK = """\
# all
stops:
  - {x: 1.50, y: 2, name: dock}  # the dock
  - {x: 2.00, y: 3, name: door}
flow: [
  [1.0, -2.50],
  [3.0, 4.0]  # last
]
deep:
- x: 0.10
  y: 1e-1
  # the name
  name: a
single:
  - 1.5
"""


@pytest.mark.parametrize(
    ('paths', 'added', 'behind', 'old', 'new'),
    [
        (
            [['stops', 0, 'y'], ['stops', 0, 'x']],
            [(4, 0.25), (5, -7.125)],
            [],
            '  # the dock\n',
            '  # the dock\n  - {x: 0.25, y: 4, name: dock}\n  - {x: -7.125, y: 5, name: dock}\n',
        ),
        ([['stops', 0, 'x']], [(9.5,)], [(2.0,)], ' door}\n', ' door}\n  - {x: 9.50, y: 2, name: dock}\n'),
        ([['flow', 1, 0]], [(5.5,)], [], '4.0]  # last\n', '4.0],  # last\n  [5.5, 4.0]\n'),
        ([['flow', 0, 1]], [(5.5,)], [(4.0,)], '4.0]  # last\n', '4.0],  # last\n  [1.0, 5.50]\n'),
        ([['single', 0]], [(2.5,), (3.5,)], [], '  - 1.5\n', '  - 1.5\n  - 2.5\n  - 3.5\n'),
    ],
)
@pytest.mark.parametrize('newline', ['\n', '\r\n'])
def test_rows_are_added_in_yaml(paths, added, behind, old, new, newline):
    content = IN_BLOCK.replace('\n', newline).encode()
    edits, depth, below = yaml_row_additions('a.yaml', content, paths, added, behind)
    assert replaced(content, edits).decode() == IN_BLOCK.replace(old, new).replace('\n', newline)
    assert (depth, below) == (2, len(behind))


@pytest.mark.parametrize(
    ('paths', 'value', 'why'),
    [
        ([['stops', 0, 'x'], ['stops', 1, 'x']], 1.0, 'a.yaml:3:3: not all numbers are in this row'),
        ([['stops', 0, 'name']], 2.5, 'a.yaml:3:3: 2.5 is of another kind than dock'),
        ([['stops', 7, 'x']], 2.5, 'the file has no stops/7/x any more'),
    ],
)
def test_what_is_no_number_of_one_row_of_yaml_gets_no_rows(paths, value, why):
    with pytest.raises(FileError, match=re.escape(why)):
        yaml_row_additions('a.yaml', IN_BLOCK.encode(), paths, [[value] * len(paths)])


def test_rows_are_added_in_a_launch_file():
    text = '<launch>\n  <rosparam>\n    rail:\n    - [1.5, 2.5]  # ä\n    - [3.5, 4.5]\n  </rosparam>\n</launch>\n'
    content = text.encode()
    edits, _, _ = inline_row_additions('a.launch', content, 0, 1, [['rail', 0, 1]], [(7.25,)])
    assert replaced(content, edits).decode() == text.replace('# ä\n', '# ä\n    - [1.5, 7.25]\n')
    with pytest.raises(FileError, match='it is not certain which <rosparam> of'):
        inline_row_additions('a.launch', content, 0, 2, [['rail', 0, 1]], [(7.25,)])
