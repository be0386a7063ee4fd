"""Calls that follow a change, in a thread of their own."""

import threading

from rosslt.node import callbacks


class Ending:
    """Stands for `rospy` in a node that may end at any moment."""

    def __init__(self):
        self.is_ending, self.has_ended = threading.Event(), threading.Event()
        self.errors = []

    def is_shutdown(self):
        return self.has_ended.is_set()

    def end(self):
        self.is_ending.set()
        self.has_ended.set()

    def logerr(self, text, *arguments):
        self.errors.append(text % arguments)


def calls(monkeypatch, *functions):
    """What is logged of functions that are called one after the other; the last one ends the node."""
    ending = Ending()
    monkeypatch.setattr(callbacks, 'rospy', ending)
    monkeypatch.setattr(callbacks, 'is_shutdown_requested', ending.is_ending.is_set)
    called = callbacks.Callbacks('calls of a test')
    for function in functions:
        called.call_soon(lambda function=function: function(ending))
    (thread,) = (one for one in threading.enumerate() if one.name == 'calls of a test')
    thread.join(60)
    assert not thread.is_alive()
    return ending.errors


def fail(_):
    raise ValueError('the value is wrong')


def end_and_fail(rospy):
    rospy.is_ending.set()  # rospy has closed the topics, and says only then that the node has ended
    raise ValueError('the topic is closed')


def test_a_fault_is_logged_and_ends_no_other_call(monkeypatch):
    (error,) = calls(monkeypatch, fail, Ending.end)
    assert 'in the thread calls of a test:' in error
    assert 'the value is wrong' in error


def test_what_the_end_of_the_node_interrupts_is_not_logged(monkeypatch):
    assert calls(monkeypatch, end_and_fail) == []
