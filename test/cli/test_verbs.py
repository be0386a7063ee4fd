"""A verb is one file in `rosslt/cli/verbs`: help, parser and tab completion derive from it."""

import re
from xml.etree import ElementTree

import pytest

from rosslt.cli import completers, completion, main, verb, verbs
from support.imports import ROOT
from support.shell import rosslt

GREET = '''
"""`rosslt greet`: greet somebody."""

from rosslt.cli.failure import Failure
from rosslt.cli.verb import LOOK, Argument

GROUP = LOOK
SUMMARY = 'greet somebody'
DESCRIPTION = 'Print a greeting.'
EXAMPLE = """\\
example:
  rosslt greet Ada
"""
ARGUMENTS = [
    Argument('name', metavar='NAME', completer='people', help='of whom'),
    Argument('--twice', action='store_true', exclusive=True),
    Argument('--times', type=int, default=1, exclusive=True, completer='times'),
]


def run(options):
    if options.name == 'nobody':
        raise Failure('there is nobody to greet')
    for _ in range(2 if options.twice else options.times):
        print('hello', options.name)
'''


@pytest.fixture
def greet(tmp_path, monkeypatch):
    """A new verb: its file, and nothing else."""
    (tmp_path / 'greet.py').write_text(GREET, encoding='utf-8')
    monkeypatch.setattr(verbs, '__path__', [*verbs.__path__, str(tmp_path)])
    monkeypatch.setattr(completers, 'people', lambda word, before: ['Ada ', 'Grace '], raising=False)
    monkeypatch.setattr(completers, 'times', lambda word, before: ['3 ', *before], raising=False)


@pytest.fixture
def completions(capsys):
    """The completions of a line."""

    def complete(line):
        completion.write_completions(line, line.split(' ')[-1])
        return capsys.readouterr().out.splitlines()

    return complete


@pytest.mark.parametrize('text', ['-1', '-.5', '-1.', '-1e-1', '-5E+3', '-1_000', '-inf', '-nan'])
def test_a_negative_number_is_no_option(text):
    for arguments in (['/talker/radius', text], [text, '/talker/radius']):
        assert text in vars(verb.parser('set').parse_intermixed_args(arguments)).values()
    forced = verb.parser('force').parse_intermixed_args(['/place/x', text, '--timeout', text])
    assert (forced.value, str(forced.timeout)) == (text, str(float(text)))


def test_it_runs(greet, capsys):
    assert main(['greet', 'Ada', '--twice']) == 0
    assert capsys.readouterr().out == 'hello Ada\n' * 2
    assert main(['greet', 'nobody']) == 1
    assert capsys.readouterr().err == 'rosslt greet: there is nobody to greet\n'


def test_it_is_in_the_help(greet, capsys):
    assert main(['-h']) == 0
    assert '  greet       greet somebody\n' in capsys.readouterr().out


def test_it_has_help(greet, capsys):
    with pytest.raises(SystemExit) as ended:
        main(['greet', '-h'])
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    assert printed.startswith('usage: rosslt greet [-h] [--twice | --times TIMES] NAME\n')
    assert printed.endswith('example:\n  rosslt greet Ada\n')


def test_it_refuses_what_it_does_not_know(greet, capsys):
    with pytest.raises(SystemExit) as ended:
        main(['greet', 'Ada', '--twice', '--times', '3'])
    assert ended.value.code == 2


@pytest.mark.parametrize(
    ('line', 'expected'),
    [
        ('rosslt gre', ['greet ']),
        ('rosslt greet ', ['Ada ', 'Grace ']),
        ('rosslt greet G', ['Grace ']),
        ('rosslt greet --t', ['--twice ', '--times ']),
        ('rosslt greet --twice G', ['Grace ']),
        ('rosslt greet --times ', ['3 ']),
        ('rosslt greet Ada --times ', ['3 ', 'Ada']),
        ('rosslt greet --times 3 A', ['Ada ']),
        ('rosslt greet Ada ', []),
    ],
)
def test_it_is_completed(greet, completions, line, expected):
    assert completions(line) == expected


def test_it_is_meant_where_it_is_misspelt(greet, capsys):
    assert main(['gret']) == 2
    assert capsys.readouterr().err == "rosslt: there is no verb 'gret' (did you mean greet?); see rosslt -h\n"


@pytest.mark.parametrize('name', verb.names())
def test_every_verb_says_all_that_a_verb_is(name):
    loaded = verb.load(name)
    assert loaded.GROUP in verb.GROUPS
    assert loaded.SUMMARY
    assert loaded.DESCRIPTION
    assert 'example' in loaded.EXAMPLE
    assert all(argument.is_option or argument.options.get('metavar') for argument in loaded.ARGUMENTS)
    assert all(hasattr(completers, argument.completer) for argument in loaded.ARGUMENTS if argument.completer)
    assert callable(loaded.run)
    assert re.search(rf'^  rosslt {name}\b', verb.parser(name).format_help(), re.MULTILINE)


@pytest.mark.parametrize(
    'line',
    [
        'list a b',
        'get',
        'set /talker/radius',
        'undo a b',
        'echo -n x /t',
        'force /gate/pose',
        'bag',
        'save',
        'save /talker talker.yaml --diff',
        'generate',
    ],
)
def test_a_verb_ends_with_2_where_it_is_misused(capsys, line):
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    assert ended.value.code == 2
    printed = capsys.readouterr()
    assert (printed.out, 'usage: ' in printed.err) == ('', True)


@pytest.mark.parametrize('line', ['', 'no_such_verb'])
def test_the_command_ends_with_2_where_it_is_misused(capsys, line):
    assert main(line.split()) == 2
    printed = capsys.readouterr()
    assert (printed.out, 'rosslt' in printed.err) == ('', True)


@pytest.mark.parametrize(
    ('line', 'expected'),
    [
        ('rosslt generate geometry_msgs/PoseS', ['geometry_msgs/PoseStamped ']),
        (
            'rosslt generate -o msg geometry_msgs/Pose geometry_msgs/Poi',
            ['geometry_msgs/Point ', 'geometry_msgs/Point32 ', 'geometry_msgs/PointStamped '],
        ),
        ('rosslt generate --package visu', ['visualization_msgs ']),
        ('rosslt generate visu', ['visualization_msgs/']),
        ('rosslt generate --d', ['--dry-run ']),
        ('rosslt force /x 1 --s', ['--source ']),
    ],
)
def test_options_and_message_types_are_completed(completions, line, expected):
    assert [each for each in completions(line) if 'Tracked' not in each] == expected


def test_the_version_is_that_of_the_package():
    package = ElementTree.parse(ROOT / 'package.xml')
    assert rosslt('--version', PYTHONUNBUFFERED='1').stdout == f'rosslt {package.findtext("version")}\n'
