"""Which fields a round brings up to date."""

import os
import subprocess
import sys

from support.browser import python_path

#: A page's numbers with a widget that notes what is set in place of viser's, and two locations of a node.
ROUNDS = """
from unittest import mock

from rosslt.msg import Location
from rosslt.node import Place
from rosslt.web.numbers import Numbers


def widget(label, value, **options):
    return mock.Mock(label=label, value=value, order=options['order'])


places = [Place('/car', Location(id=number, name=name, type='float', value='1.0')) for number, name in
          enumerate(['pedal', 'gear'])]
locations = mock.Mock()
locations.places.return_value = {'/car': places}
locations.is_changed.return_value = False
server = mock.MagicMock()
server.gui.add_number = mock.Mock(side_effect=widget)
numbers = Numbers(server, locations, mock.Mock(), mock.Mock())
numbers.update()
pedal, gear = (numbers._fields['/car', number].widget for number in (0, 1))
for place in places:
    place.location.value = '2.5'
locations.fresh.return_value = {('/car', 0): places[0], ('/car', 7): places[0]}
numbers.follow()
print(pedal.value, gear.value)
numbers.update()
print(pedal.value, gear.value)
"""


def test_a_change_that_an_owner_tells_of_is_shown_without_looking_at_all_fields():
    done = subprocess.run(
        [sys.executable, '-c', ROUNDS],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
        text=True,
        timeout=120,
        env=dict(os.environ, PYTHONPATH=python_path()),
    )
    assert done.stdout.split() == ['2.5', '1.0', '2.5', '2.5'], done.stderr
