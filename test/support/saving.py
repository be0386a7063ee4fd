"""Nodes whose values are changed and saved, and what they publish."""

import rospy

import rosslt
from rosslt import node, srv
from support.processes import wait_until
from support.shell import rosslt as command


class Hearing:
    """What arrives on a topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self._subscriber = rosslt.Subscriber(topic, kind, self.messages.append, queue_size=10)

    def next(self, condition=lambda message: True):
        """The next message that begins after now and for which a condition holds."""
        del self.messages[:]
        found = []

        def look():
            found.extend(message for message in list(self.messages[1:]) if condition(message))
            return found

        wait_until(look, 'a message', 60)
        return found[0]

    def stop(self):
        self._subscriber.unregister()


def is_whole(message):
    """Whether its numbers have their sources; others are sampled."""
    return rosslt.UNKNOWN not in rosslt.sources(message)


def point(message):
    return [float(value) for value in (message.point.x, message.point.y, message.point.z)]


def save(name, *options):
    result = command('save', *options, name)
    assert result.returncode == 0, result.stderr
    return result.stdout


def places(name):
    found, silent = node.Directory().ask([name])
    assert not silent
    return found[name]


def change(name, values):
    """Set locations of a node at once: {id: value}."""
    answer = rospy.ServiceProxy(name + '/rosslt/change_sources', srv.ChangeSources)(
        location_ids=list(values), values=[node.to_json(value) for value in values.values()]
    )
    assert answer.state == 'applied', answer.reasons
