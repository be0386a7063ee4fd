"""The worked example in docs/wire_format.md is what is sent, byte for byte."""

import io
import re
from pathlib import Path

from geometry_msgs.msg import Point

from rosslt import Source, track
from rosslt.messages import SampledProvenance, append_provenance, attach, decode, split_provenance
from rosslt.values import untracked
from support.filling import assert_arrived

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'wire_format.md'
SENT = re.compile(r'^((?:[0-9a-f]{2} )*[0-9a-f]{2})(?:  |$)', re.MULTILINE)


def example(number=0):
    section = PAGE.read_text(encoding='utf-8').split('## A worked example')[1]
    return bytes.fromhex(' '.join(SENT.findall(section.split('```')[2 * number + 1])))


def message():
    x = track(0.25, Source('/script', 0x21D6A37D9B01))
    n = track(3, Source('/script', 7))
    return Point(x, 2.5 * x + n, x * n)


def test_the_example_is_what_is_sent():
    buff = io.BytesIO()
    message().serialize(buff)
    append_provenance(message(), buff)
    assert buff.getvalue().hex(' ') == example().hex(' ')


def test_the_example_of_a_sampled_message_is_what_is_sent_and_understood():
    sampled, buff = SampledProvenance(lambda: 20.0, lambda: 0.0, lambda: 0.5), io.BytesIO()
    sampled.to_send(message(), False, 0)
    message().serialize(buff)
    append_provenance(message(), buff, sampled.to_send(message(), False, 0))
    assert buff.getvalue().hex(' ') == example(1).hex(' ')
    assert decode(example(1), Point) == (untracked(message()), None, True)


def test_the_example_is_understood():
    plain, provenance = split_provenance(example(), Point)
    received = Point().deserialize(plain)
    attach(received, provenance)
    assert_arrived(message(), received)
