"""What a call costs, counted in what is done: the same on every machine, whatever else it does."""

import sys


def instructions_run(function):
    """How many of Python's instructions a call takes.

    What is done in one go in C, such as packing numbers, counts as one.
    """
    count, before = 0, sys.gettrace()

    def trace(frame, event, _argument):
        nonlocal count
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        count += event == 'opcode'
        return trace

    sys.settrace(trace)
    try:
        function()
    finally:
        sys.settrace(before)
    return count
