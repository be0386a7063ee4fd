"""A live script: numbers rewritten by changes, texts saved by people, and what becomes of both at the same time."""

import contextlib
import random
import threading
from types import SimpleNamespace

import pytest

import rosslt
from rosslt import files
from rosslt.files.rows import operate
from rosslt.script import LiveScript, ScriptError, Settings
from support.header_fuzz import mutated
from support.processes import wait_until

TOUR = """# tour
height = 1.5
goto(2.0, 1.0, height)  # the table
wait(1)
goto(-1, 2, height + 0.5)
"""

TOUR_STEPS = 3  # how many they are

#: A script with all kinds of numbers, to be changed at random.
SCRIPT = """\
height = 1.5
def row(a, count=2):
    return [a * i for i in range(count)]
for x in row(1.0, 3):
    goto(x, -1.5e-3, height + 0x10)  # the table
wait(.5)
"""


class Stage:
    """A live script with the locations that a node would have."""

    def __init__(self, path, **options):
        self.path, self.lock = path, threading.RLock()
        self.locations, self.runs, self.errors = {}, [], []
        self.script = LiveScript(
            str(path),
            self.add,
            self.remove,
            lambda *run: self.runs.append(run),
            self.errors.append,
            **options,
        )

    def add(self, name, site, getter, setter):
        source = rosslt.Source('/interactive_script', hash(name))
        made = SimpleNamespace(name=name, site=site, get=getter, set=setter, source=source)
        made.lock = threading.Lock()
        with self.lock:
            assert name not in self.locations
            self.locations[name] = made
        return made

    def remove(self, location):
        with self.lock:
            assert self.locations.pop(location.name) is location

    def change(self, location, value):
        """As a node does it: only where the location is known, and without holding the lock of its locations."""
        with self.lock:
            if self.locations.get(location.name) is not location:
                raise KeyError('unknown')
        location.set(value)

    def at(self, line, column):
        """The location that stands there."""
        return next(one for one in self.locations.values() if one.site[1:3] == (line, column))

    @property
    def steps(self):
        return self.runs[-1][0]

    @property
    def text(self):
        return self.path.read_text()

    def save(self, text):
        """Save as a person's editor does; then the watch checks the file."""
        self.path.write_text(text)
        self.script.reload()


@pytest.fixture
def stage(tmp_path):
    path = tmp_path / 'tour.script'
    path.write_text(TOUR)
    return Stage(path)


def test_every_number_is_a_location_that_says_where_it_is(stage):
    assert [one.site[1:3] for one in stage.locations.values()] == [
        (2, 10),
        (3, 6),
        (3, 11),
        (4, 6),
        (5, 6),
        (5, 10),
        (5, 22),
    ]
    assert {one.site.file for one in stage.locations.values()} == {str(stage.path)}
    assert stage.at(3, 6).site.text == 'goto(2.0, 1.0, height)  # the table'
    assert [one.get() for one in stage.locations.values()] == [1.5, 2.0, 1.0, 1.0, -1.0, 2.0, 0.5]


def test_a_change_rewrites_that_number_in_the_file_and_the_script_runs_again(stage):
    stage.change(stage.at(3, 11), -0.1234)
    assert stage.text == TOUR.replace('1.0', '-0.123')
    assert stage.steps[0] == (2.0, -0.123, 1.5)
    assert stage.runs[-1][1], 'it differs in its numbers alone'


def test_a_number_that_a_change_has_moved_along_its_line_keeps_its_location(stage):
    second = stage.at(3, 11)
    stage.change(stage.at(3, 6), -12.345)
    assert second.site[1:3] == (3, 15)
    stage.change(second, 7)
    assert 'goto(-12.345, 7.0, height)' in stage.text
    assert len(stage.locations) == 7


def test_a_change_that_the_script_cannot_run_with_is_refused_and_leaves_the_file_as_it_is(tmp_path):
    path = tmp_path / 'tour.script'
    path.write_text('for i in range(3): goto(i, 1 / 2, 0)')
    stage = Stage(path)
    with pytest.raises(ScriptError, match=r'tour\.script:1:.*TypeError'):
        stage.change(stage.at(1, 16), 2.5)
    with pytest.raises(ScriptError, match='ZeroDivisionError'):
        stage.change(stage.at(1, 32), 0)
    assert stage.text == 'for i in range(3): goto(i, 1 / 2, 0)'
    assert len(stage.runs) == 1
    stage.change(stage.at(1, 16), 2.0)
    assert 'range(2)' in stage.text


def test_a_change_below_the_precision_changes_nothing(stage):
    stage.change(stage.at(3, 6), 2.0004)
    assert stage.text == TOUR
    assert len(stage.runs) == 1


@pytest.mark.parametrize(
    ('precision', 'expected'), [(0.1, '2.3'), (0.25, '2.25'), (1, '2.0'), (10, '0.0'), (1e-6, '2.345679')]
)
def test_numbers_are_rounded_to_the_precision(stage, precision, expected):
    coarse = Stage(stage.path, settings=Settings(precision=precision, step_limit=100))
    coarse.change(coarse.at(3, 6), 2.3456789)
    assert f'goto({expected},' in coarse.text


def test_a_saved_text_comes_into_force(stage):
    stage.save(TOUR.replace('1.5', '3.5'))
    assert stage.steps[0].z == 3.5
    assert stage.runs[-1][1], 'it differs in its numbers alone'
    stage.save(TOUR + 'goto(0, 0, 0)\n')
    assert len(stage.steps) == 4
    assert not stage.runs[-1][1]


@pytest.mark.parametrize(
    ('text', 'place'),
    [('goto(1, 2\n', ':1:5: '), ('goto(1, 2)\n', ':1:1: '), ('import os\n', ':1:1: '), ('while True: pass', ':1:')],
)
def test_the_last_good_script_stays_in_force_when_a_saved_one_has_an_error(stage, text, place):
    stage.save(text)
    (error,) = stage.errors
    assert str(error).startswith(str(stage.path) + place)
    assert len(stage.runs) == 1
    assert len(stage.locations) == 7
    stage.script.reload()
    assert len(stage.errors) == 1, 'it says so once'
    stage.save(TOUR)
    assert len(stage.runs) == 2, 'it is said to be in force again'
    stage.script.reload()
    assert len(stage.runs) == 2
    stage.change(stage.at(3, 6), 5.0)
    assert 'goto(5.0, 1.0, height)' in stage.text


def test_an_editor_that_empties_the_file_before_it_writes_keeps_the_locations_and_the_tour(stage):
    before, text = dict(stage.locations), TOUR.replace('2.0', '4.0')
    stage.path.write_text('')
    timer = threading.Timer(0.05, stage.path.write_text, [text])
    timer.start()
    stage.script.reload()
    timer.join()
    assert [is_same_but_for_numbers for _, is_same_but_for_numbers in stage.runs[1:]] == [True]
    assert stage.steps[0] == (4.0, 1.0, 1.5)
    kept = [name for name, location in before.items() if stage.locations.get(name) is location]
    assert len(kept) == 5, 'all but those of the line that was edited'


def test_a_change_while_the_saved_script_has_an_error_is_refused(stage):
    location = stage.at(3, 6)
    stage.path.write_text('goto(2.0,')
    with pytest.raises(ScriptError, match='has an error, which has to be corrected first'):
        stage.change(location, 5.0)
    assert stage.text == 'goto(2.0,'


def test_a_script_with_an_error_at_the_start_waits_for_a_better_one(tmp_path):
    path = tmp_path / 'tour.script'
    path.write_text('goto(1')
    stage = Stage(path)
    assert len(stage.errors) == 1
    stage.save(TOUR)
    assert stage.steps[0] == (2.0, 1.0, 1.5)


def test_a_script_that_is_gone_for_a_while_stays_in_force(stage):
    stage.path.unlink()
    stage.script.reload()
    assert 'No such file' in str(stage.errors[-1])
    with pytest.raises(ScriptError):
        stage.change(stage.at(3, 6), 5.0)
    stage.save(TOUR.replace('2.0', '4.0'))
    assert stage.steps[0].x == 4.0


def test_a_change_against_a_text_that_has_moved_lands_on_the_number_it_was_meant_for(stage):
    location = stage.at(5, 6)
    stage.path.write_text('goto(9, 9, 9)\n' + TOUR)  # the watch has not read it yet
    stage.change(location, 5.0)
    assert stage.text == 'goto(9, 9, 9)\n' + TOUR.replace('-1', '5')
    assert location.site[1:3] == (6, 6)


def test_a_change_of_a_number_that_somebody_has_edited_is_refused(stage):
    location = stage.at(3, 6)
    for text in (TOUR.replace('2.0', '3.0'), TOUR.replace('goto(2.0, 1.0, height)  # the table\n', '')):
        stage.path.write_text(text)
        with pytest.raises((ScriptError, KeyError)):
            stage.change(location, 5.0)
        assert stage.text == text


def test_an_id_never_comes_to_mean_another_number(tmp_path):
    """Equal lines are added and removed at random: the comment on a line says what its id meant at first."""
    dice, path = random.Random(7), tmp_path / 'tour.script'
    lines = ['goto(0, 0, 0)  # {}'.format(number) for number in range(4)]
    path.write_text('\n'.join(lines))
    stage, meant = Stage(path), {}
    for number in range(4, 60):
        if lines and dice.random() < 0.5:
            lines.pop(dice.randrange(len(lines)))
        lines.insert(dice.randrange(len(lines) + 1), 'goto(0, 0, 0)  # {}'.format(number))
        stage.save('\n'.join(lines))
        for location in stage.locations.values():
            place = location.site.text.partition('#')[2], location.site.column
            assert meant.setdefault(location.name, place) == place


@pytest.mark.parametrize('seed', [0, *[pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 10)]])
def test_rows_that_have_no_equal_keep_their_ids_as_rows_change(seed, tmp_path):
    dice, path = random.Random(seed), tmp_path / 'tour.script'
    path.write_text('height = 1.5\n' + ''.join(f'goto({number}.25, 0, height)  # {number}\n' for number in range(4)))
    stage, fresh = Stage(path), 4

    def ids():
        """{text of a line: the ids of its numbers} of those lines that are there once."""
        texts = stage.text.splitlines()
        at = {number: [one.name for one in stage.locations.values() if one.site.line == number] for number in range(99)}
        return {text: at[number] for number, text in enumerate(texts, 1) if texts.count(text) == 1}

    for _ in range(100):
        before, count = ids(), len(stage.text.splitlines()) - 1
        row = dice.randint(1, count)
        moves = [files.UP] * (row > 1) + [files.DOWN] * (row < count)
        operation = dice.choice([*moves, *[files.DUPLICATE] * (count < 6), *[files.DELETE] * (count > 2)])
        content = path.read_bytes()
        edits, _ = files.python_row_edits(str(path), content, row + 1, 6, operation)
        stage.save(files.replaced(content, edits).decode())
        after = ids()
        print(operation, row, stage.text)  # shown where the test fails
        for text in before.keys() & after.keys():
            assert sorted(before[text]) == sorted(after[text])
            assert len(before[text]) in (1, 2)
        lines = stage.text.splitlines(True)
        equal = [place for place, line in enumerate(lines) if lines.index(line) < place]
        for place in equal:  # a person changes the copy
            fresh += 1
            lines[place] = f'goto({fresh}.25, 0, height)  # {fresh}\n'
        stage.save(''.join(lines))
    assert not stage.errors


@pytest.mark.parametrize('seed', [0, *[pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 10)]])
def test_equal_rows_keep_their_ids_if_it_is_known_which_they_are(seed, tmp_path):
    dice, path, told = random.Random(seed), tmp_path / 'tour.script', {}
    path.write_text('a = 1.5\n' + 'goto(1.5, a, 2.5)\ngoto(1.5, a, 7.5)\n' * 2 + 'b = 2.5')
    stage = Stage(path, numbers_of_rows=lambda before, after: told.get((before, after), ()))

    def ids():
        """The ids of the numbers of each line."""
        found = sorted((one.site.line, one.site.column, one.name) for one in stage.locations.values())
        return [[name for line, _, name in found if line == number] for number in range(1, count + 3)]

    count = 4
    expected = ids()
    for _ in range(100):
        row = dice.randint(1, count)
        moves = [files.UP] * (row > 1) + [files.DOWN] * (row < count)
        operation = dice.choice([*moves, *[files.DUPLICATE] * (count < 6), *[files.DELETE] * (count > 2)])
        content = path.read_bytes()
        edits, numbers = files.python_row_edits(str(path), content, row + 1, 6, operation)
        made = files.replaced(content, edits)
        told[files.digest_of(content), files.digest_of(made)] = numbers
        stage.save(made.decode())
        if made != content:  # equal rows that are moved past each other leave the text as it is
            operate(expected, row, operation)
        count = len(expected) - 2
        found = ids()
        if operation == files.DUPLICATE:
            assert len(found[row + 1]) == 2
            assert not {*found[row + 1]} & {name for names in expected for name in names}
            expected[row + 1] = found[row + 1]
        assert found == expected
    assert not stage.errors


@pytest.mark.parametrize('which', [[0], [0, 0, 1, 2, 3], [0, 1, 2, 3, 9], [0, 1, 2, 3, -1], [0, 1, 2, 'x', 3], None])
def test_what_is_said_of_numbers_and_cannot_be_is_not_believed(which, tmp_path):
    path = tmp_path / 'tour.script'
    path.write_text('a = 1\nb = 2\nc = 3\nd = 4\n')
    stage = Stage(path, numbers_of_rows=lambda before, after: which or ())
    names = [stage.at(line, 5).name for line in range(1, 5)]
    stage.save('new = 5\na = 1\nb = 2\nc = 3\nd = 4\n')
    assert [stage.at(line, 5).name for line in range(2, 6)] == names
    assert not stage.errors


def test_persons_and_changes_at_the_same_moment_lose_nothing(stage):
    """Somebody saves a line more, over and over, while a number is dragged."""
    files.FileWatch(str(stage.path), stage.script.reload)
    location, refused = stage.at(2, 10), 0
    done = threading.Event()

    def type_lines():
        for number in range(30):
            while not files.replace_bytes(
                str(stage.path), text := stage.path.read_bytes(), text + b'wait(%d)\n' % number
            ):
                pass
            wait_until(lambda number=number: len(stage.steps) == TOUR_STEPS + number + 1, 'it to be taken in')
        done.set()

    person = threading.Thread(target=type_lines)
    person.start()
    value = 0.0
    while not done.is_set():
        value += 0.5
        try:
            stage.change(location, value)
        except ScriptError:
            refused += 1
            value -= 0.5
    person.join()
    lines = stage.text.splitlines()
    assert lines[1] == 'height = {}'.format(value)
    assert lines[5:] == ['wait({})'.format(number) for number in range(30)]
    assert refused == 0
    wait_until(lambda: len(stage.locations) == 7 + 30, 'the locations of other texts to be forgotten')
    assert stage.errors == []


def test_a_script_that_was_changed_comes_into_force_or_is_reported(tmp_path):
    path = tmp_path / 'a.script'
    path.write_text(SCRIPT)
    live, chance = Stage(path), random.Random(3)
    parts = [
        b'\0',
        b'\xff\xfe',
        b'\xef\xbb\xbf',
        b'(',
        b'1e999',
        b'9' * 5000,
        b'1j',
        b'"',
        b'\\\n',
        b'lambda: ',
        b'2**99**9',
    ]
    for _ in range(150):
        path.write_bytes(mutated(SCRIPT.encode(), chance, parts))
        live.script.reload()
        if live.locations and chance.random() < 0.3:
            with contextlib.suppress(ScriptError):
                live.change(chance.choice(list(live.locations.values())), chance.choice([0.0, -1e300, 1e-9, 7.0]))
    assert len(live.errors) > 50
    live.save(SCRIPT)
    assert len(live.locations) == 7
    assert len(live.steps) == 4


@pytest.mark.parametrize(
    ('data', 'reason'),
    [
        (TOUR.encode('utf-16'), 'invalid or missing encoding'),
        (b'wait(1)\0', 'null byte'),
        (b'x = ' + b'-' * 100000 + b'1', 'nested too deeply'),
        (b'x = ' + b'1 + ' * 9000 + b'1', 'nested too deeply'),
        (b'x' + b'.x' * 100000, 'nested too deeply'),
        (b'x = ' + b'(' * 9000 + b'1' + b')' * 9000, 'nested'),
        (b'while True: pass', 'does not end'),
        (b'x = 9 ** 9 ** 9', 'too large'),
    ],
    ids=lambda value: value if isinstance(value, str) else '',
)
def test_a_script_that_is_no_script_is_reported_with_the_reason(stage, data, reason):
    stage.path.write_bytes(data)
    stage.script.reload()
    assert reason in str(stage.errors[-1])
    assert len(stage.locations) == 7
