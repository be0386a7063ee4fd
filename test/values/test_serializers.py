"""Other libraries write tracked values as the plain values they are, or refuse them aloud."""

import io
import marshal
import subprocess
import sys
import xmlrpc.client
from pathlib import Path

import pytest

import rosslt
from rosslt import Source, serializers, track, untracked

yaml = pytest.importorskip('yaml')

A = Source('/node', 1)
VALUES = [0.3, 1e300, -0.0, 7, 0, True, False, 'map', '', 'null', '1.5']
SRC = Path(__file__).resolve().parents[2] / 'src'
DUMPERS = ['Dumper', 'SafeDumper', 'CDumper', 'CSafeDumper']


@pytest.mark.parametrize('dumper', [name for name in DUMPERS if hasattr(yaml, name)])
def test_yaml_writes_the_plain_value(dumper):
    for value in VALUES:
        data = {'a': [track(value, A)], 'b': track(value, A)}
        written = yaml.dump(data, Dumper=getattr(yaml, dumper))
        assert written == yaml.dump(untracked(data), Dumper=getattr(yaml, dumper))
        (read,) = yaml.safe_load(written)['a']
        assert read == value
        assert type(read) is type(value)


def test_yaml_writes_the_plain_value_where_a_dumper_has_representers_of_its_own():
    class Own(yaml.SafeDumper):
        pass

    Own.add_representer(complex, lambda dumper, value: dumper.represent_str(str(value)))
    serializers.register()
    assert yaml.dump([track(0.3, A)], Dumper=Own) == yaml.dump([0.3], Dumper=Own)


def test_a_tracked_text_is_a_key_of_yaml():
    assert yaml.safe_load(yaml.safe_dump({track('name', A): 1})) == {'name': 1}


@pytest.mark.parametrize('value', [value for value in VALUES if value != 1e300])
def test_xmlrpc_writes_the_plain_value(value):
    assert xmlrpc.client.dumps((track(value, A),)) == xmlrpc.client.dumps((value,))
    assert xmlrpc.client.dumps(({'a': [track(value, A)]},)) == xmlrpc.client.dumps(({'a': [value]},))


def test_what_takes_no_subclasses_refuses_aloud():
    with pytest.raises(ValueError, match='unmarshallable'):
        marshal.dump(track(0.3, A), io.BytesIO())
    with pytest.raises(TypeError, match='intern'):
        sys.intern(track('map', A))
    assert marshal.dumps(untracked(track(0.3, A))) == marshal.dumps(0.3)


def run(program):
    code = 'import sys; sys.path.insert(0, %r)\n%s' % (str(SRC), program)
    return subprocess.run(
        [sys.executable, '-c', code], check=True, stdout=subprocess.PIPE, encoding='utf-8', env={}
    ).stdout.split()


def test_all_names_are_imported_outside_a_built_workspace():
    assert run('from rosslt import *\nprint(track(0.3, Source("/n", 1)), "Publisher" in globals())') == ['0.3', 'False']


def test_the_version_is_that_of_the_manifest():
    manifest = Path(__file__).resolve().parents[2] / 'package.xml'
    assert '<version>%s</version>' % rosslt.__version__ in manifest.read_text(encoding='utf-8')
    assert run('import rosslt; print(rosslt.__version__)') == [rosslt.__version__]


def test_the_package_says_that_it_is_annotated():
    assert any((Path(folder) / 'py.typed').is_file() for folder in rosslt.__path__)
