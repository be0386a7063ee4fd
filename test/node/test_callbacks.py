"""Calls that follow a change, in a thread of their own."""

import threading

from rosslt.node import callbacks


class Ending:
    """Stands for `rospy` in a node that may end at any moment."""

    def __init__(self):
        self.has_ended = threading.Event()
        self.errors = []

    def is_shutdown(self):
        return self.has_ended.is_set()

    def logerr(self, text, *arguments):
        self.errors.append(text % arguments)


def calls(monkeypatch, *functions):
    """What is logged of functions that are called one after the other; the last one ends the node."""
    monkeypatch.setattr(callbacks, 'rospy', Ending())
    called = callbacks.Callbacks('calls of a test')
    for function in functions:
        called.call_soon(lambda function=function: function(callbacks.rospy))
    (thread,) = (one for one in threading.enumerate() if one.name == 'calls of a test')
    thread.join(60)
    assert not thread.is_alive()
    return callbacks.rospy.errors


def fail(_):
    raise ValueError('the value is wrong')


def end_and_fail(rospy):
    rospy.has_ended.set()
    raise ValueError('the topic is closed')


def test_a_fault_is_logged_and_ends_no_other_call(monkeypatch):
    (error,) = calls(monkeypatch, fail, lambda rospy: rospy.has_ended.set())
    assert 'in the thread calls of a test:' in error
    assert 'the value is wrong' in error


def test_what_the_end_of_the_node_interrupts_is_not_logged(monkeypatch):
    assert calls(monkeypatch, end_and_fail) == []
