"""What a terminal shows while `rosslt teach` runs; what is misused, and what completes it; test/teach has the rest."""

import pytest

from rosslt.cli import completers, completion, main
from rosslt.cli.verbs import teach


def test_terminal_shows_holder_place_numbers_and_refusals(monkeypatch, capsys):
    monkeypatch.setattr(teach, 'is_terminal', lambda: True)
    monkeypatch.setenv('COLUMNS', '100')
    screen = teach.Screen('/joy')
    screen.name = '/box'
    screen.show(False, (1.0, 2.0, 0.0), {'x': 1.0, 'frame': 'world'})
    screen.show(True, (1.5, 2.0, 0.0), {'x': 1.5, 'frame': 'world'})
    screen.say('x is locked')
    screen.end()
    shown = capsys.readouterr().out
    held = '/joy holds /box at 1.500 2.000 0.000: x = 1.5'
    first = '\r\x1b[Knobody holds /box at 1.000 2.000 0.000: x = 1'
    assert shown == f'{first}\r\x1b[K{held}\r\x1b[Kx is locked\n{held}\n'


def test_terminal_shows_whole_numbers_without_a_point(monkeypatch, capsys):
    monkeypatch.setattr(teach, 'is_terminal', lambda: True)
    screen = teach.Screen('/joy')
    screen.name = '/pid/count'
    screen.show(True, [123456], {'count': 123456})
    assert capsys.readouterr().out.endswith('/joy holds /pid/count at 123456: count = 123456')


def test_pipe_gets_a_line_when_the_hand_takes_hold_and_lets_go(capsys):
    screen = teach.Screen('/joy')
    screen.name = '/box'
    for is_held in (False, True, True, False):
        screen.show(is_held, (1.5, 2.0, 0.0), {'x': 1.5})
    assert capsys.readouterr().out == 'holds\t/box\t/joy\t1.5\t2.0\t0.0\nlets go\t/box\t/joy\t1.5\t2.0\t0.0\n'


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (['/goal'], 'give --by DEVICE, or --match WANTED=MEASURED'),
        (['--by', '/joy'], '--by needs a TARGET'),
        (['--match', '/grip=/gripper', '--by', '/joy'], 'not allowed with'),
        (['/goal', '--by', '/joy', '--press', '/joy'], '--press is for --match'),
        (['/goal', '--append'], 'give --by DEVICE, or --match'),
        (['/goal', '--by', '/joy', '--append', '--record'], 'each press, and --record writes a path'),
        (['/goal', '--by', '/joy', '--append', '--dry-run'], 'each press, and --dry-run changes nothing'),
        (['/goal', '--by', '/joy', '--append', '--press', '/joy'], '--button 0 of /joy holds: choose another one'),
        (['/goal', '--by', '/joy', '--append', '--button', '-1'], '--button must not be negative'),
        (['/goal', '--by', 'tf:'], '--by tf: needs the name of a frame, as tf:hand'),
        (['/goal', '--by', '/joy', '--in', 'world'], '--in is for a frame of tf'),
        (['/goal', '--by', '/joy', '--only', 'x,up'], '--only takes some of x,y,z,roll,pitch,yaw; found x,up'),
        (['/goal', '--by', '/joy', '--only', ''], '--only takes some of'),
        (['/goal', '--by', '/joy', '--turn', '3'], '--turn must be three numbers of axes, as 0,1,2; found 3'),
        (['/goal', '--by', '/joy', '--turn-speed', '0'], '--turn-speed must be a number above 0, found 0.0'),
        (['/goal', '--by', '/joy', '--scale', 'inf'], '--scale must be a number above 0, found inf'),
        (['/goal', '--by', '/joy', '--smooth', '-1'], '--smooth must be a number of at least 0, found -1.0'),
        (['/goal', '--by', '/joy', '--snap', 'nan'], '--snap must be a number of at least 0, found nan'),
        (['/goal', '--by', '/joy', '--expo', '1.5'], '--expo must be a number from 0 to 1, found 1.5'),
        (['/goal', '--match', '/grip=/gripper'], '/goal is for --by'),
        (['--match', '/grip'], '--match takes WANTED=MEASURED'),
        (['--match', '/grip=/gripper', '--button', '-1'], '--button must not be negative'),
    ],
)
def test_what_does_not_fit_together_is_misused(words, told, capsys):
    with pytest.raises(SystemExit) as ended:
        main(['teach', *words])
    assert ended.value.code == 2
    assert told in capsys.readouterr().err


def test_both_sides_of_a_match_are_completed(monkeypatch, capsys):
    monkeypatch.setattr(completers, 'topics', lambda word, before=(), end=' ': ['/goal' + end, '/goal/data '])
    monkeypatch.setattr(completers, '_joints', lambda word: [])
    assert list(completers.matches('/go')) == ['/goal/', '/goal/data=']
    assert list(completers.matches('/a/data=/go')) == ['/a/data=/goal ', '/a/data=/goal/data ']
    line = 'rosslt teach --match /a/data='
    for typed, seen in (('', '='), ('/go', '/go')):
        completion.write_completions(line + typed, seen)
        assert capsys.readouterr().out.splitlines() == ['/goal ', '/goal/data ']


def test_joints_are_completed_on_both_sides_of_a_match(monkeypatch, capsys):
    monkeypatch.setattr(completers, 'topics', lambda word, before=(), end=' ': ['/leader' + end])
    monkeypatch.setattr(completers, '_joints', lambda word: ['/leader:elbow ' if ':' in word else '/leader:'])
    assert list(completers.matches('/le')) == ['/leader/', '/leader:']
    assert list(completers.matches('/leader:')) == ['/leader:elbow=']
    line = 'rosslt teach --match /command:elbow='
    for typed, seen, offered in (('/le', '/le', ['/leader ', '/leader:']), ('/leader:el', 'el', ['elbow '])):
        completion.write_completions(line + typed, seen)
        assert capsys.readouterr().out.splitlines() == offered


def test_a_joint_is_completed_behind_the_colon_as_bash_splits_words(monkeypatch, capsys):
    monkeypatch.setattr(completers, 'targets', lambda word, before=(): ['/command:elbow '])
    for typed, seen in (('', ':'), ('el', 'el')):
        completion.write_completions('rosslt teach /command:' + typed, seen)
        assert capsys.readouterr().out == 'elbow \n'


def test_pipe_gets_a_line_for_each_press_and_each_remark(capsys):
    from rosslt.teach import Answer

    teach._show('/joy', Answer(True, 'seen', [('/arm/a', 1.0, 2.0), ('/arm/b', 3.0, 4.0)], ['c stays']))
    teach._show('/joy', Answer(False, 'a is locked'))
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == 'matches\t/joy\t/arm/a\t1.0\t2.0\t/arm/b\t3.0\t4.0'
    assert lines[1:] == ['says\t/joy\tseen', 'says\t/joy\tc stays', 'refused\t/joy\ta is locked']
