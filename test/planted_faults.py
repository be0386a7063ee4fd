#!/usr/bin/env python3
"""Faults that are planted on purpose, to see whether the tests notice them.

Each stands for a slip that a careless engineer could make and that would hurt a user. It is planted in a clone of this
repository, in a temporary folder, and taken back after its tests. `test_planted_faults.py` keeps the list up to date.

    ./run exec python3 test/planted_faults.py -h
"""

import argparse
import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Iterator, NamedTuple, Tuple

ROOT = Path(__file__).resolve().parent.parent


class Fault(NamedTuple):
    """A fault: its name, a file below src/rosslt, a text that occurs exactly once in it, the text in its stead, and the
    arguments with which `./run test` runs the tests of its room, which must notice it."""

    name: str
    file: str
    old: str
    new: str
    tests: Tuple[str, ...]


def suite(name: str) -> Tuple[str, ...]:
    """The arguments that choose one rostest suite."""
    return ('test/test_rostests.py', '-k', name)


FAULTS = [
    # --- values
    Fault(
        'slope_with_a_wrong_sign',
        'values/operations/table.py',
        'slope=(lambda a: math.cos(a),))',
        'slope=(lambda a: -math.cos(a),))',
        ('test/values/test_table.py',),
    ),
    Fault(
        'inverse_with_swapped_operands',
        'values/operations/table.py',
        'inverse=(lambda y, a, b: y + b, lambda y, a, b: a - y),',
        'inverse=(lambda y, a, b: y + b, lambda y, a, b: y - a),',
        ('test/values/test_table.py',),
    ),
    Fault(
        'answer_beyond_a_bound',
        'values/solve/scalar.py',
        'if is_beyond:\n',
        'if is_beyond and value != value:\n',
        ('test/values/test_solving.py', 'test/values/test_solving_limits.py'),
    ),
    Fault(
        'fit_that_moves_what_is_read_only',
        'values/fit.py',
        '{UNKNOWN, *read_only, *_without_room(bounds or {})}',
        '{*_without_room(bounds or {})}',
        ('test/values/test_fit.py',),
    ),
    Fault(
        'compiled_subtraction_with_swapped_operands',
        'values/core/numbers.c',
        'return operate(SUBTRACT, v, w);',
        'return operate(SUBTRACT, w, v);',
        ('test/values/test_core.py', 'test/values/test_tracked.py'),
    ),
    # --- files
    Fault(
        'file_that_was_saved_meanwhile_is_overwritten',
        'files/atomic_replacement.py',
        '    if displaced == expected:\n        return True',
        '    if displaced != placed:\n        return True',
        ('test/files/test_atomic_replacement.py', 'test/files/test_failures.py'),
    ),
    Fault(
        'file_with_two_names_is_overwritten',
        'files/atomic_replacement.py',
        '        if file.read() != expected:\n            return False',
        '        file.read()',
        ('test/files/test_atomic_replacement.py', 'test/files/test_failures.py'),
    ),
    Fault(
        'first_of_several_files_stays_changed',
        'files/transaction.py',
        'for path in reversed(done):',
        'for path in reversed(done[1:]):',
        ('test/files/test_python_source.py',),
    ),
    # --- messages
    Fault(
        'varint_off_by_one',
        'messages/codec/varint.py',
        'if not numbers or max(numbers) < 128:',
        'if not numbers or max(numbers) <= 128:',
        ('test/messages/test_wire.py', 'test/messages/test_wire_is_strict.py'),
    ),
    Fault(
        'end_of_a_message_taken_for_a_provenance',
        'messages/inband.py',
        'if start < 0 or start != (end(data, 0, len(data)) if size is None else size):',
        'if start < 0:',
        ('test/messages/test_inband.py',),
    ),
    Fault(
        'plain_message_told_with_the_provenance_of_another_one',
        'messages/sampling.py',
        '        if not (is_sampled or fields):\n            return message\n',
        '',
        ('test/messages/test_sampling.py',),
    ),
    Fault(
        'plain_message_after_a_change',
        'messages/sampling.py',
        '            self._due = dict.fromkeys(self._due, -math.inf)\n            self._state = state',
        '            self._state = state',
        ('test/messages/test_sampling.py',),
    ),
    Fault(
        'nodes_that_read_each_other_wait_for_ever',
        'messages/sampling.py',
        'if now - since > seconds and count >= messages:',
        'if now - since < 0.0:',
        ('test/messages/test_sampling.py',),
    ),
    # --- node
    Fault(
        'an_older_message_is_taken_for_the_new_one',
        'node/change/change_request.py',
        'return Shown.OLD if is_old else Shown.OTHER',
        'return Shown.OTHER',
        ('test/node/test_change_request.py',),
    ),
    Fault(
        'a_state_that_is_set_back',
        'values/core/slots.c',
        'is_done = found == expected && put',
        'is_done = found != NULL && put',
        ('test/values/test_slots.py',),
    ),
    Fault(
        'local_variables_that_do_not_follow',
        'node/memory/walk.py',
        '            self._waiting += running()\n',
        '            pass\n',
        ('test/instrument/test_memory.py', '-k', 'kept and literal'),
    ),
    Fault(
        'maximum_that_is_not_checked',
        'node/locations/location.py',
        'if maximum is not None and value > maximum:',
        'if maximum is not None and minimum is not None and value > maximum:',
        ('test/node/test_commit_participant.py',),
    ),
    Fault(
        'change_of_a_node_where_one_location_refuses',
        'node/change/commit_participant.py',
        '        if any(change.reasons):\n            change.state = REFUSED\n\n',
        '        if all(change.reasons):\n            change.state = REFUSED\n\n',
        ('test/node/test_commit_participant.py',),
    ),
    Fault(
        'setters_not_put_back_where_one_refuses',
        'node/location_server.py',
        "'; '.join([str(refused), *self._put_back(done)])",
        'str(refused)',
        ('test/node/test_commit_participant.py',),
    ),
    Fault(
        'reserved_location_that_is_changed_by_others',
        'node/change/commit_participant.py',
        '            self._holders.update((location, together) for location, _ in change.wanted)\n',
        '',
        ('test/node/test_commit_participant.py', *suite('node/commit')),
    ),
    Fault(
        'change_of_several_nodes_where_one_refuses',
        'node/change/commit_coordinator.py',
        '            if outcome.is_done:\n                self._take_changes',
        '            if self._prepared:\n                self._take_changes',
        suite('node/commit'),
    ),
    Fault(
        'lock_that_refuses_nobody',
        'node/change/locks.py',
        '            if lock is not None:\n                raise Refused',
        '            if lock is not None and lock.who == requester:\n                raise Refused',
        suite('node/commit'),
    ),
    Fault(
        'undo_of_what_others_have_changed_since',
        'node/change/history.py',
        '                        others[location] = request\n',
        '                        others.pop(location, None)\n',
        suite('node/history'),
    ),
    # --- instrument
    Fault(
        'state_that_gets_a_handle',
        'instrument/states.py',
        'if change.target in states and change.refers_to_itself:',
        'if change.target in states and not change.refers_to_itself:',
        ('test/instrument/test_location_rules.py', 'test/instrument/test_tree_rewriting.py'),
    ),
    Fault(
        'comment_with_swapped_bounds',
        'instrument/literals.py',
        '(_bound(low), _bound(high))',
        '(_bound(high), _bound(low))',
        ('test/instrument/test_location_rules.py',),
    ),
    Fault(
        'cell_that_ignores_a_change',
        'instrument/cells.py',
        '        self.cells[self.number] = plain(self.tracked) if self.keeps is False else self.tracked',
        '        self.cells[self.number] = self.literal',
        ('test/instrument/test_cells.py',),
    ),
    # --- script
    Fault(
        'number_that_lands_in_its_neighbour',
        'script/live.py',
        '{state.numbers.index(number): rounded_value}',
        '{state.numbers.index(number) - 1: rounded_value}',
        ('test/script/test_live.py',),
    ),
    Fault(
        'numbers_below_an_edit_that_are_lost',
        'files/python_source.py',
        'template = (source.text[start:last]',
        "template = f'{line}:' + (source.text[start:last]",
        ('test/files/test_python_source.py',),
    ),
    Fault(
        'script_that_is_overwritten_by_a_drag',
        'script/live.py',
        'if content == state.source.content:\n                    if number',
        'if content != self._refused:\n                    if number',
        ('test/script/test_live.py',),
    ),
    # --- flow
    Fault(
        'node_that_the_flow_leaves_out',
        'flow/flow.py',
        '[step for node in self._subscribers.get(reach.topic, ()) for step in steps_of(node)],',
        '[],',
        ('test/flow',),
    ),
    Fault(
        'drawing_through_nodes_that_publish_nothing_of_it',
        'flow/flow.py',
        'publishers.intersection(self._subscribers.get(topic, ()))',
        'publishers.union(self._subscribers.get(topic, ()))',
        ('test/flow',),
    ),
    # --- models
    Fault(
        'halving_that_leaves_out_the_second_half',
        'models/trials.py',
        'self.halve(between, middle, end, inputs[half:], change)',
        'self.halve(between, middle, middle, inputs[half:], change)',
        ('test/models',),
    ),
    # --- markers
    Fault(
        'a_whole_turn_is_rounded_to_none',
        'markers/drags/changes.py',
        'is_near = all(way * abs(slope) <= most for slope, most in zip(slopes[source], allowed))',
        'is_near = True',
        ('test/markers/test_changes.py',),
    ),
    Fault(
        'an_angle_without_effect_is_rounded_to_none',
        'markers/drags/changes.py',
        'is_near = is_near and way <= abs(after[source] - present[source])',
        'is_near = is_near',
        ('test/markers/test_changes.py',),
    ),
    Fault(
        'a_number_is_rounded_beyond_its_bound',
        'markers/drags/changes.py',
        'if low <= rounder <= high and is_near',
        'if is_near',
        ('test/markers/test_changes.py',),
    ),
    Fault(
        'handle_along_a_wrong_axis',
        'markers/scene/handles.py',
        'tuple(float(index == axis) for index in range(3))',
        'tuple(float(index == 2 - axis) for index in range(3))',
        ('test/markers/test_handles.py',),
    ),
    Fault(
        'point_that_moves_in_the_coordinates_of_the_frame',
        'markers/scene/handles.py',
        'local = rotate_vector(inverse(self._base[3:]), offset)',
        'local = offset',
        ('test/markers/test_handles.py',),
    ),
    Fault(
        'handle_of_what_takes_no_changes',
        'markers/scene/handles.py',
        'x, y, z = (has_source(value) and can_change(value) for value in coordinates)',
        'x, y, z = (has_source(value) for value in coordinates)',
        ('test/markers/test_handles.py',),
    ),
    # --- web
    Fault(
        'field_that_shows_the_old_value',
        'web/location_inputs.py',
        'if is_quiet and field.widget.value != _shown(place):',
        'if is_quiet and field.widget.value is None:',
        ('test/web/test_location_inputs.py',),
    ),
    # --- teach
    Fault(
        'device_that_leaps',
        'teach/hand.py',
        'if _length(way) > self._options.max_step:',
        'if _length(way) > 1e9:',
        suite('teaching'),
    ),
    Fault(
        'hand_that_trembles',
        'teach/filtering.py',
        '/ unit) ** 3)',
        '/ unit))',
        ('test/teach/test_filtering.py',),
    ),
    Fault(
        'measurement_that_is_old',
        'teach/matcher.py',
        'if now - arrived <= OLD]',
        'if now - arrived <= 1e9]',
        suite('matching'),
    ),
    # --- cli
    Fault(
        'exit_code_0_in_spite_of_a_failure',
        'cli/__init__.py',
        '        return 0\n    return 1\n',
        '        return 0\n    return 0\n',
        ('test/cli/test_verbs.py',),
    ),
    Fault(
        'save_that_writes_what_is_only_to_be_shown',
        'cli/verbs/save.py',
        '            write_diff(files.unified_diff(edits))\n        else:\n            files.write(edits)',
        '            write_diff(files.unified_diff(edits))\n        files.write(edits)',
        ('test/instrument/test_saving.py',),
    ),
    Fault(
        'number_that_is_not_finite',
        'cli/fields.py',
        'if value - value != 0:',
        'if value != value:',
        ('test/cli/test_fields.py',),
    ),
]


def text_with(fault: Fault, root: Path) -> str:
    """The text of the file of a fault; ValueError where the old text does not occur exactly once in it."""
    text = (root / 'src/rosslt' / fault.file).read_text(encoding='utf-8')
    if text.count(fault.old) != 1:
        raise ValueError(f'{fault.name}: its old text stands {text.count(fault.old)} times in {fault.file}, not once')
    return text


def write(path: Path, text: str) -> None:
    """Write a file that is newer than before by a second or more, so that all that is made of it is made anew."""
    newer = max(time.time(), path.stat().st_mtime + 1)
    path.write_text(text, encoding='utf-8')
    os.utime(path, (newer, newer))


@contextlib.contextmanager
def planted(fault: Fault, root: Path) -> Iterator[None]:
    """Have a fault in a clone for a while."""
    path, text = root / 'src/rosslt' / fault.file, text_with(fault, root)
    write(path, text.replace(fault.old, fault.new))
    try:
        yield
    finally:
        write(path, text)


def run(root: Path, *arguments: str) -> Tuple[int, str]:
    """Have `./run` of a clone do something; returns its status and output, and leaves nothing that runs."""
    pipe = {'stdout': subprocess.PIPE, 'stderr': subprocess.STDOUT}
    process = subprocess.Popen([str(root / 'run'), *arguments], text=True, start_new_session=True, **pipe)
    try:
        output, _ = process.communicate()
    finally:
        with contextlib.suppress(ProcessLookupError):  # once all have ended, in the order of `./run`
            while True:
                os.killpg(process.pid, signal.SIGTERM)
                process.poll()
                time.sleep(0.1)
    return process.returncode, output


def cloned(folder: str) -> Path:
    """Clone and build in a folder what is committed; returns the path of the clone."""
    root = Path(folder, 'rosslt')
    subprocess.run(['git', 'clone', '--quiet', str(ROOT), str(root)], check=True)
    (root / 'build/.workspace').mkdir(parents=True)
    for name in ('build/.workspace/page', 'build/.workspace/lint'):
        if (ROOT / name).exists():
            (root / name).symlink_to((ROOT / name).resolve())
    for fault in FAULTS:
        text_with(fault, root)
    status, output = run(root, 'build')
    if status:
        raise ValueError(f'the clone cannot be built:\n{output}')
    return root


def verdict(fault: Fault, root: Path, is_whole: bool) -> Tuple[bool, str]:
    """Whether a test notices a fault, and passes without it; and the words that say so."""
    with planted(fault, root):
        tests = ('--numprocesses', '2') if is_whole else fault.tests
        status, output = run(root, 'test', *tests, '-x', '-q')
    if status == 0:
        return False, 'NOT CAUGHT'
    found = re.search(r'^(?:FAILED|ERROR) (test/\S+?::.+?)(?: - .*)?$', output, re.MULTILINE)
    if found is None:
        return False, f'NOT CAUGHT, as the tests did not run:\n{output[-2000:]}'
    status, output = run(root, 'test', found.group(1), '-q')
    if status:
        return False, f'NOT CAUGHT, as {found.group(1)} fails without it, too:\n{output[-2000:]}'
    return True, f'caught by {found.group(1)}'


def main() -> int:
    """Try faults; returns 1 where one is not noticed."""
    text = (
        'Plant faults in a clone of what is committed, and run tests. The exit code is 1 where a fault is not noticed.'
    )
    parser = argparse.ArgumentParser(description=text, epilog='faults: ' + ' '.join(fault.name for fault in FAULTS))
    parser.add_argument('--whole', action='store_true', help='run all short tests for each, not only its own')
    parser.add_argument('names', nargs='*', metavar='NAME', help='of a fault; by default all')
    options = parser.parse_args()
    unknown = set(options.names).difference(fault.name for fault in FAULTS)
    if unknown:
        parser.error(f'no fault is called {" or ".join(sorted(unknown))}')
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: sys.exit(128 + number))
    faults = [fault for fault in FAULTS if fault.name in options.names or not options.names]
    caught = 0
    with tempfile.TemporaryDirectory(prefix='rosslt_faults_') as folder:
        try:
            root = cloned(folder)
        except ValueError as error:
            sys.exit(f'planted_faults.py: {error}')
        for fault in faults:
            start = time.monotonic()
            is_caught, words = verdict(fault, root, options.whole)
            caught += is_caught
            print(f'{fault.name} ({fault.file}): {words} [{time.monotonic() - start:.0f} s]', flush=True)
    print(f'{caught} of {len(faults)} faults were caught')
    return 0 if caught == len(faults) else 1


if __name__ == '__main__':
    sys.exit(main())
