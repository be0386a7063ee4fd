"""What a terminal shows while `rosslt teach` runs; test/teach has the devices."""

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


def test_pipe_gets_a_line_when_the_hand_takes_hold_and_lets_go(capsys):
    screen = teach.Screen('/joy')
    screen.name = '/box'
    for is_held in (False, True, True, False):
        screen.show(is_held, (1.5, 2.0, 0.0), {'x': 1.5})
    assert capsys.readouterr().out == 'holds\t/box\t/joy\t1.5\t2.0\t0.0\nlets go\t/box\t/joy\t1.5\t2.0\t0.0\n'
