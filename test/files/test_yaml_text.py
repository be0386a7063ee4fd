"""Other numbers in a YAML file, and everything else in it as it was."""

import pytest

from rosslt.files import FileError
from rosslt.files import yaml_with_values as with_values

FILE = """# A tour.
pause: 1.50   # seconds
"waypoints":
  - [2.0, 1.0, &low 0.5]  # up
  - {x: -1.5,
     name: "home",  z: 1.0e-1}

limits: [*low, on, ~]
"""


def test_what_is_the_same_stays_as_it_is_written():
    assert with_values(FILE, {'pause': 1.5, 'limits': [0.5, True, None]}, 'tour.yaml') == FILE


def test_what_differs_is_rewritten_and_nothing_else():
    changed = with_values(FILE, {'waypoints': [[2.25, 1.0, 0.5], {'x': 3, 'z': -0.1}]}, 'tour.yaml')
    assert changed == FILE.replace('2.0', '2.25').replace('-1.5', '3').replace('1.0e-1', '-0.1')


def test_texts_and_truth_values_keep_their_kind():
    changed = with_values(
        FILE, {'waypoints': [[2.0, 1.0, 0.5], {'name': 'on'}], 'limits': [0.5, False, 'ä']}, 'tour.yaml'
    )
    assert changed == FILE.replace('"home"', "'on'").replace('on, ~]', 'false, ä]')


def test_an_anchor_stays_and_what_it_names_is_rewritten():
    assert with_values(FILE, {'limits': [0.75, True, None]}, 'tour.yaml') == FILE.replace('&low 0.5', '&low 0.75')


@pytest.mark.parametrize(
    ('data', 'reason'),
    [
        ({'waypoints': [[2.0, 1.0, 0.5]]}, 'tour.yaml:4:3: the file has another shape'),
        ({'pause': [1.5]}, 'tour.yaml:2:8: the file has another shape'),
        ({'speed': 1.0}, 'tour.yaml:2:1: the file has another shape'),
        ({'waypoints': [[2.0, 1.0, 0.75], {}], 'limits': [0.5, True, None]}, 'tour.yaml:4:16: this is one value'),
    ],
)
def test_what_cannot_be_written_is_refused_with_the_place(data, reason):
    with pytest.raises(FileError) as caught:
        with_values(FILE, data, 'tour.yaml')
    assert str(caught.value).startswith(reason)


def test_a_file_that_is_no_yaml_is_refused_with_the_place():
    with pytest.raises(FileError, match=r'tour\.yaml:2:1'):
        with_values('a: [1,\n', {'a': [1]}, 'tour.yaml')
