"""Which loops are rounds, and which belong to the set-up."""

import textwrap
import threading

import pytest

from rosslt.node.memory import rounds
from rosslt.node.memory.remembered import Memory

#: Loops that belong to the set-up. `work` raises in its first two calls.
SET_UP = {
    'nothing but waiting': """
        while not is_ready():
            sleep()
        """,
    'break after what is tried': """
        while True:
            try:
                work()
                break
            except ValueError as error:
                print(error)
                sleep()
        """,
    'waiting after what is tried': """
        while True:
            print('trying')
            try:
                work()
                break
            except ValueError:
                pass
            sleep()
        """,
    'else': """
        for _ in range(10):
            try:
                work()
            except ValueError:
                sleep()
            else:
                break
        """,
    'return': """
        while True:
            try:
                return work()
            except ValueError:
                if is_ready():
                    raise
            finally:
                sleep()
        """,
    'continue while it fails': """
        while True:
            try:
                found = work()
            except ValueError:
                sleep()
                continue
            print(found)
            break
        """,
    'one turn': """
        while True:
            sleep()
            is_ready()
            break
        """,
}

#: Loops that are rounds.
ROUNDS = {
    'work': """
        while not is_ready():
            is_ready()
            sleep()
        """,
    'break in an if': """
        while True:
            found = is_ready()
            if found:
                break
            sleep()
        """,
    'work before what is tried': """
        while True:
            is_ready()
            try:
                work()
                break
            except ValueError:
                sleep()
        """,
    'work between': """
        while True:
            try:
                work()
                break
            except ValueError:
                is_ready()
                sleep()
        """,
    'errors alone end no turn': """
        while not is_ready():
            try:
                work()
            except ValueError:
                sleep()
        """,
    'continue in what is tried': """
        while True:
            try:
                if not is_ready():
                    sleep()
                    continue
                break
            except ValueError:
                sleep()
        """,
}


@pytest.mark.parametrize(
    ('text', 'begins'),
    [(text, False) for text in SET_UP.values()] + [(text, True) for text in ROUNDS.values()],
    ids=[*SET_UP, *ROUNDS],
)
def test_which_loops_begin_a_round(tmp_path, monkeypatch, text, begins):
    memory, calls = Memory(), {'work': 0, 'is_ready': 0}
    monkeypatch.setattr(rounds, 'MEMORY', memory)
    # tests that run in parallel may not run in the main thread of their process
    monkeypatch.setattr(threading, 'main_thread', threading.current_thread)

    def work():
        calls['work'] += 1
        if calls['work'] < 3:
            raise ValueError('not yet')

    def is_ready():
        calls['is_ready'] += 1
        return calls['is_ready'] >= 6

    file = tmp_path / 'node.py'
    # what runs the tests is no part of the node
    monkeypatch.setattr(rounds, 'is_own_module', lambda names: names.get('__file__') == str(file))
    file.write_text('def run():\n' + textwrap.indent(textwrap.dedent(text), '    '))
    names = {'__file__': str(file), 'sleep': rounds.begins_round(lambda: None), 'work': work, 'is_ready': is_ready}
    exec(compile(file.read_text(), str(file), 'exec'), names)
    names['run']()
    assert memory.has_begun is begins
