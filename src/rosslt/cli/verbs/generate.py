"""`rosslt generate`: the generator of tracked message types, under its own arguments."""

from rosslt.messages import generate_tracked_msgs


def run(arguments):
    return generate_tracked_msgs(arguments, 'rosslt generate')
