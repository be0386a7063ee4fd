"""Short texts for handles, with the important part first."""

import re
from typing import Callable, Dict

from rosslt import node, values

#: Why a hand does not get hold of a thing.
HELD = 'somebody else holds it'

#: Numbers that are shortened to a few digits beside a marker.
LONG_NUMBER = re.compile(r'-?\d+\.\d{4,}(e[-+]?\d+)?')

#: The text that a node puts before the reason of a setter that refuses, with the name of the exception.
REFUSING_SETTER = re.compile(r'^(the setter of \S+ refuses .*?: )?([A-Z]\w+: )?')


def refusal(error: Exception) -> str:
    """Why a change was refused: each reason once, without the names of who passed it on."""
    if not isinstance(error, node.ChangeRejected):
        return short_numbers(str(error))
    reasons: Dict[str, None] = {}
    for reason in error.reasons.values():
        reasons[REFUSING_SETTER.sub('', reason)] = None
    return short_numbers('; '.join(reasons) or str(error))


def short_numbers(text: str) -> str:
    """A text with long numbers cut to four digits."""
    return LONG_NUMBER.sub(lambda number: '%.4g' % float(number.group()), text)


def limit(stops: Dict[values.Source, str], name_of: Callable[[values.Source], str]) -> str:
    """A text that says which sources have come to their bounds: `distance is at its minimum 0.5`."""
    return ', '.join('{} is at its {}'.format(name_of(source), stop) for source, stop in stops.items())
