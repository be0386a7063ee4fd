"""Bags that were changed at random: read, or refused."""

import contextlib
import random
import struct

import genpy
import pytest
import rosbag

from rosslt import untracked
from rosslt.cli import main
from rosslt.messages import encode
from support.filling import serialized
from support.header_fuzz import messages, mutated


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
        path.write_bytes(mutated(recorded, chance, parts))
        with contextlib.suppress(FileNotFoundError):
            out.unlink()
        verb = chance.choice([[], [], ['--set', '/node#1=3', '-o', str(out)]])
        status = main(['bag', str(path), *verb])
        said = capsys.readouterr().err
        assert status == 0 or said.startswith('rosslt bag: '), said
        assert 'Traceback' not in said
        refused += status != 0
    assert refused > 20
