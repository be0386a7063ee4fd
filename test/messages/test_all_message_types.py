"""Every message type that is installed can be tracked: generated, compiled by genpy, filled, sent, received."""

import importlib.util
import sys

import genpy.generate_initpy
import genpy.generator
import genpy.message
import pytest

from rosslt.cli import run as run_verb
from rosslt.messages import append_provenance, attach, split_provenance, tracked_type, unwrap, wrap
from rosslt.messages.msg_files.definitions import MessagePath, data_type
from support.filling import Filling, assert_arrived, serialized

PACKAGE = 'rosslt_test_tracked'
PATH = MessagePath()


def has_python(package):
    """Whether the messages of a package can be imported."""
    try:
        return importlib.util.find_spec(package + '.msg') is not None
    except ModuleNotFoundError:
        return False


TYPES = [
    name
    for package in PATH.packages()
    if has_python(package)
    for name in PATH.types(package)
    if not data_type(PATH.read(name))
]


@pytest.fixture(scope='module')
def generated(tmp_path_factory):
    """{message type: tracked class}, all made by the generator and genpy, as the build does it."""
    folder = tmp_path_factory.mktemp('generated')
    assert run_verb('generate', ['-o', str(folder / 'msg'), *TYPES]) == 0
    files = sorted((folder / 'msg').glob('*.msg'))
    assert len(files) == len(TYPES)
    search_path = {package: list(PATH.folders(package)) for package in PATH.packages()}
    assert (
        genpy.generator.MsgGenerator().generate_messages(
            PACKAGE, [str(file) for file in files], str(folder / PACKAGE), search_path
        )
        == 0
    )
    genpy.generate_initpy.write_modules(str(folder / PACKAGE))
    sys.path.insert(0, str(folder))
    try:
        module = importlib.import_module(PACKAGE)
        yield {cls._slot_types[1]: cls for cls in (getattr(module, file.stem) for file in files)}
    finally:
        sys.path.remove(str(folder))


def test_the_message_packages_of_debian_are_there():
    assert len(TYPES) >= 150, 'only %d message types are installed' % len(TYPES)


@pytest.mark.parametrize('name', TYPES)
def test_a_generated_tracked_type_carries_every_field(generated, name):
    message_class = genpy.message.get_message_class(name)
    for seed in range(3):
        sent = Filling(seed).message(message_class)
        data = serialized(wrap(sent, generated[name]))
        assert_arrived(sent, unwrap(generated[name]().deserialize(data)), seed)


@pytest.mark.parametrize('name', TYPES)
def test_an_ordinary_message_carries_every_field_in_band(name, tmp_path):
    message_class = genpy.message.get_message_class(name)
    sent = Filling(7).message(message_class)
    with (tmp_path / 'sent').open('w+b') as buff:
        sent.serialize(buff)
        append_provenance(sent, buff)
        buff.seek(0)
        data = buff.read()
    assert message_class().deserialize(data) == message_class().deserialize(serialized(sent))
    plain, provenance = split_provenance(data, message_class)
    assert plain == serialized(sent)
    received = message_class().deserialize(plain)
    attach(received, provenance)
    assert_arrived(sent, received)


@pytest.mark.parametrize('name', TYPES)
def test_a_type_made_at_run_time_is_the_generated_one(generated, name):
    made = tracked_type(name)
    sent = Filling(1).message(genpy.message.get_message_class(name))
    assert made._md5sum == generated[name]._md5sum
    assert serialized(wrap(sent, made)) == serialized(wrap(sent, generated[name]))
