"""The end of a process that has done what it was started for."""

import threading

import rospy

from rosslt.node.rospy_internals import add_shutdown_hook

#: The timeout of unregistering this node from the master, in seconds.
TIMEOUT = 2.0


def leave() -> None:
    """Unregister this process from the master, so that it may end at once.

    rospy does so at the end of each process, too, and then waits up to 0.6 s for its threads, which have nothing left
    to do.
    """
    if rospy.is_shutdown():
        return
    unregistered = threading.Event()
    add_shutdown_hook(lambda _reason: unregistered.set())  # called after those that unregister
    threading.Thread(target=rospy.signal_shutdown, args=('done',), name='rosslt leaving', daemon=True).start()
    unregistered.wait(TIMEOUT)
