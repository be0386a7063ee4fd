"""Runs a program of this folder: some rounds of it, or one at 10 Hz in a node that publishes what it computes."""

import sys
import time

RATE = 10.0


def run(compute, rounds):
    """Compute so many rounds and print the CPU time in seconds; with `--node`, publish the result of each for ever."""
    if '--node' not in sys.argv:
        start = time.process_time()
        for _ in range(rounds):
            compute()
        print(f'cpu {time.process_time() - start:.3f}')
        return
    import rospy
    from std_msgs.msg import Float64MultiArray

    rospy.init_node('program')
    publisher = rospy.Publisher('result', Float64MultiArray, queue_size=1)
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        publisher.publish(Float64MultiArray(data=[float(number) for number in compute()]))
        rate.sleep()
