"""Which loops are rounds, which belong to the set-up, and when a round is over."""

import contextlib
import textwrap
import threading
import time

import pytest
import rospy

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


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A function that runs the body of a node's function in this thread, which is taken for the main thread."""
    monkeypatch.setattr(rounds, 'MEMORY', Memory())
    rounds.MEMORY.has_begun = True
    monkeypatch.setattr(threading, 'main_thread', threading.current_thread)
    file = tmp_path / 'node.py'
    monkeypatch.setattr(rounds, 'is_own_module', lambda names: names.get('__file__') == str(file))

    def call(text, **names):
        file.write_text('def run():\n' + textwrap.indent(textwrap.dedent(text), '    '))
        names.update(__file__=str(file), time=time, rospy=rospy)
        exec(compile(file.read_text(), str(file), 'exec'), names)
        names['run']()

    return call


def test_a_round_is_over_where_the_main_thread_waits_again(run):
    sleep, seen = time.sleep, []
    with contextlib.ExitStack() as stack:

        def turn(count):
            if count in (1, 2):  # two who wait, one after the other
                watched.append(stack.enter_context(rounds.watch_round(lambda: seen.append(count))))
            states.append([one.is_over for one in watched])

        watched, states = [], []
        run(
            """
            for count in range(5):
                turn(count)
                time.sleep(0)
            """,
            turn=turn,
        )
        assert states == [[], [False], [False, False], [True, False], [True, True]]
        assert seen == [1, 2]
        assert time.sleep is not sleep
    assert time.sleep is sleep


@pytest.fixture
def looking():
    """A function that watches a round; and what it finds: whether the round is over, and nothing is replaced."""
    sleep, found = time.sleep, []

    def look():
        with rounds.watch_round(lambda: None) as watched:
            found.append((watched.is_over, time.sleep is sleep))
        return True

    return look, found


@pytest.mark.parametrize('text', ['look()', 'while not look():\n    time.sleep(0)'], ids=['no loop', 'it only waits'])
def test_a_main_thread_in_no_loop_is_not_waited_for(run, looking, text):
    look, found = looking
    run(text, look=look)
    assert found == [(True, True)]


def test_a_main_thread_that_spins_is_not_waited_for(run, looking, monkeypatch):
    look, found = looking
    monkeypatch.setattr(rospy.core, 'is_initialized', lambda: True)
    monkeypatch.setattr(rospy.core, 'is_shutdown', look)
    run(
        """
        for _ in range(1):
            print()
            rospy.spin()
        """
    )
    assert found[0] == (True, True)
