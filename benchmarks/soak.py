"""A scripted hand that drags a marker there and back for a long time: nothing grows, nothing is lost, nothing drifts.

`./run bench soak --minutes 30`. It ends with status 1 and says what was not flat.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple

import rosgraph
import rospy
from visualization_msgs.msg import Marker

from rosslt.messages import split_provenance

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from support.hand import Hand
from support.processes import Node, wait_until

TALKER = """
    from visualization_msgs.msg import Marker
    publisher = rosslt.Publisher('soaked', Marker, queue_size=100)
    rate = rospy.Rate(20)
    number = 0
    while not rospy.is_shutdown():
        number += 1
        marker = Marker(ns='cube', type=Marker.CUBE, text=str(number))
        marker.header.frame_id = 'world'
        marker.pose.position.x = 2 * rosslt.location(1.0, name='x') + 1
        marker.pose.position.y = rosslt.get_param('~y', 0.0) / 3
        marker.pose.orientation.w = marker.color.a = marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        publisher.publish(marker)
        rate.sleep()
    """

MARKER = '/soaked:cube:0'

#: By how much the hand drags, in metres, and how far from its start a source may be after as many drags back: what a
#: hand reports has 32 bits.
STEP, DRIFT = 0.5, 1e-5

#: How much more memory a node may have at the end than after the first half, in kB: Python's own comes and goes.
GROWTH = 4096


class Sample(NamedTuple):
    """What is measured of the nodes at a moment; memory in kB, provenance in bytes."""

    memory: Dict[str, int]
    threads: Dict[str, int]
    files: Dict[str, int]
    parameters: int
    provenance: int


class Listener:
    """Hears every message: how many are missing, and how large the provenance of the last one is."""

    def __init__(self) -> None:
        self.missing = self.provenance = self.heard = 0
        self._last = 0
        rospy.Subscriber('soaked', rospy.AnyMsg, self._hear)

    def _hear(self, message: rospy.AnyMsg) -> None:
        self.provenance = len(split_provenance(message._buff, Marker)[1])
        marker = Marker()
        marker.deserialize(message._buff)
        number = int(marker.text)
        if self.heard:
            self.missing += number - self._last - 1
        self._last = number
        self.heard += 1


def measured(pids: Dict[str, int], listener: Listener) -> Sample:
    """A sample of now."""
    memory, threads, files = {}, {}, {}
    for name, pid in pids.items():
        status = dict(
            line.split(':', 1) for line in Path(f'/proc/{pid}/status').read_text(encoding='utf-8').splitlines()
        )
        memory[name] = int(status['VmRSS'].split()[0])
        threads[name] = int(status['Threads'])
        files[name] = len(os.listdir(f'/proc/{pid}/fd'))
    return Sample(memory, threads, files, len(rosgraph.Master('/soak').getParamNames()), listener.provenance)


def faults(half: Sample, end: Sample, listener: Listener, drift: float) -> List[str]:
    """What was not flat between the half and the end."""
    found = []
    for name, before in half.memory.items():
        if end.memory[name] > before + GROWTH:
            found.append(f'{name} has grown from {before} to {end.memory[name]} kB')
        if end.threads[name] > half.threads[name] + 1:  # one may be at work in that moment
            found.append(f'{name} has {end.threads[name]} threads, {half.threads[name]} before')
        if end.files[name] > half.files[name] + 2:
            found.append(f'{name} has {end.files[name]} open files, {half.files[name]} before')
    if end.parameters != half.parameters:
        found.append(f'there are {end.parameters} parameters, {half.parameters} before')
    if end.provenance > half.provenance + 8:
        found.append(f'a message has {end.provenance} bytes of provenance, {half.provenance} before')
    if listener.missing:
        found.append(f'{listener.missing} of {listener.heard} messages are missing')
    if abs(drift) > DRIFT:
        found.append(f'the source has drifted by {drift}')
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--minutes', type=float, default=3.0, help='how long (default: 3)')
    parser.add_argument('--pause', type=float, default=2.0, help='between two drags, in seconds (default: 2)')
    options = parser.parse_args()
    rospy.init_node('soak')
    with Node('soaked', TALKER) as talker:
        markers = subprocess.Popen(
            ['rosrun', 'rosslt', 'slt_visualization'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            return soak(options, {'talker': talker.process.pid, 'slt_visualization': markers.pid})
        finally:
            markers.send_signal(signal.SIGINT)
            markers.wait()


def soak(options: argparse.Namespace, pids: Dict[str, int]) -> int:
    """Drag until the time is over; returns the exit status."""
    listener, hand = Listener(), Hand()
    start = hand.position(MARKER)[0]
    began, drags, half = time.monotonic(), 0, None
    while True:
        for by in (STEP, -STEP):
            wanted = hand.position(MARKER)[0] + by
            hand.drag(MARKER, dx=by)
            wait_until(lambda wanted=wanted: abs(hand.position(MARKER)[0] - wanted) < DRIFT, 'it follows', 60.0)
            drags += 1
            time.sleep(options.pause)
        passed = time.monotonic() - began
        if half is None and passed > 30 * options.minutes:
            half = measured(pids, listener)
        if passed > 60 * options.minutes and half is not None:
            break
    end = measured(pids, listener)
    print(f'{drags} drags in {passed / 60:.1f} minutes, {listener.heard} messages, {listener.missing} missing')
    for word, sample in (('half', half), ('end', end)):
        print(f'  {word}: {sample}')
    drift = hand.position(MARKER)[0] - start
    print(f'  drift: {drift:.1e} m')
    found = faults(half, end, listener, drift)
    for text in found:
        print('  not flat:', text)
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
