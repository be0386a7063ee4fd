"""The bag of a joystick that devices.launch plays is as the script beside it makes it."""

import importlib.util
import io
from pathlib import Path

import rosbag

CONFIG = Path(__file__).resolve().parents[2] / 'config'


def test_the_bag_has_what_its_script_makes():
    spec = importlib.util.spec_from_file_location('make_joystick_bag', CONFIG / 'make_joystick_bag.py')
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    with rosbag.Bag(str(CONFIG / 'joystick.bag')) as bag:
        recorded = [(topic, data, stamp) for topic, (_, data, *_), stamp in bag.read_messages(raw=True)]
    assert recorded == [(maker.TOPIC, serialized(one), one.header.stamp) for one in maker.hand()]


def serialized(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
