"""Bags and scripts that were changed at random, or made to be slow: read, or refused."""

import contextlib
import random
import struct
import threading
from types import SimpleNamespace

import genpy
import pytest
import rosbag

from rosslt import Source, untracked
from rosslt.cli import main
from rosslt.messages import encode
from rosslt.script import LiveScript, ScriptError
from support.filling import serialized
from support.header_fuzz import messages

SCRIPT = """\
height = 1.5
def row(a, count=2):
    return [a * i for i in range(count)]
for x in row(1.0, 3):
    goto(x, -1.5e-3, height + 0x10)  # the table
wait(.5)
"""


def changed(data, chance, parts):
    """Data with some bytes changed, put in or taken out."""
    data = bytearray(data)
    for _ in range(chance.choice([1, 2, 6])):
        place, way = chance.randrange(len(data) + 1), chance.randrange(5)
        if way == 0:
            data[place : place + 1] = bytes([chance.randrange(256)])
        elif way == 1:
            del data[place : place + chance.randrange(1, 40)]
        elif way == 2:
            data[place:place] = chance.choice(parts)
        elif way == 3 and chance.random() < 0.3:
            del data[place:]
        else:
            start = chance.randrange(len(data) + 1)
            data[place:place] = data[start : start + 30]
    return bytes(data)


@pytest.fixture(scope='module', params=['none', 'bz2', 'lz4'])
def recorded(request, tmp_path_factory):
    """A bag as bytes, with one message of each kind of provenance."""
    path = tmp_path_factory.mktemp('bags') / 'right.bag'
    with rosbag.Bag(str(path), 'w', compression=request.param) as bag:
        for number, message in enumerate(messages()):
            provenance = encode(message, number % 2 == 0)
            data = serialized(untracked(message)) + provenance + struct.pack('<I4s', len(provenance), b'rSLT')
            raw = message._type, data, message._md5sum, None, type(message)
            bag.write('/t%d' % number, raw, genpy.Time(number + 1), raw=True)
    return path.read_bytes()


def test_a_bag_that_was_changed_is_read_or_refused_with_a_reason(recorded, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:1')
    chance, path, out = random.Random(5), tmp_path / 'changed.bag', tmp_path / 'out.bag'
    parts = [b'md5sum=', b'topic=', b'\xff' * 8, bytes(8), b'index_pos=', b'\x20\0\0\0']
    refused = 0
    for _ in range(60):
        path.write_bytes(changed(recorded, chance, parts))
        with contextlib.suppress(FileNotFoundError):
            out.unlink()
        verb = chance.choice([[], [], ['--set', '/node#1=3', '-o', str(out)]])
        status = main(['bag', str(path), *verb])
        said = capsys.readouterr().err
        assert status == 0 or said.startswith('rosslt bag: '), said
        assert 'Traceback' not in said
        refused += status != 0
    assert refused > 20


class Locations:
    """The locations of a live script, and its errors."""

    def __init__(self, path):
        self.there, self.errors, self.runs = {}, [], []
        self.script = LiveScript(
            str(path), self._add, self._remove, lambda *run: self.runs.append(run), self.errors.append
        )

    def _add(self, name, site, getter, setter):
        made = SimpleNamespace(name=name, get=getter, set=setter, source=Source('/script', hash(name)))
        made.lock = threading.Lock()
        self.there[name] = made
        return made

    def _remove(self, location):
        del self.there[location.name]


def test_a_script_that_was_changed_comes_into_force_or_is_reported(tmp_path):
    path = tmp_path / 'a.script'
    path.write_text(SCRIPT)
    live, chance = Locations(path), random.Random(3)
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
        path.write_bytes(changed(SCRIPT.encode(), chance, parts))
        live.script.reload()
        if live.there and chance.random() < 0.3:
            with contextlib.suppress(ScriptError):
                chance.choice(list(live.there.values())).set(chance.choice([0.0, -1e300, 1e-9, 7.0]))
    assert len(live.errors) > 50
    path.write_text(SCRIPT)
    live.script.reload()
    assert len(live.there) == 7
    assert len(live.runs[-1][0]) == 4


@pytest.mark.parametrize(
    ('data', 'reason'),
    [
        (SCRIPT.encode('utf-16'), 'invalid or missing encoding'),
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
def test_a_script_that_is_no_script_is_reported_with_the_reason(tmp_path, data, reason):
    path = tmp_path / 'a.script'
    path.write_text(SCRIPT)
    live = Locations(path)
    path.write_bytes(data)
    live.script.reload()
    assert reason in str(live.errors[-1])
    assert len(live.there) == 7
