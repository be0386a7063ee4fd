"""Where what was learned of nodes is kept, and how its age is said: without the room that reads it, which takes NumPy
and SciPy."""

import os

import rospkg


def learned_folder() -> str:
    """The folder of the files in which it is kept."""
    return os.path.join(rospkg.get_ros_home(), 'rosslt', 'learned')


def is_any_learned() -> bool:
    """Return whether anything was learned of any node."""
    try:
        return any(name.endswith('.json') for name in os.listdir(learned_folder()))
    except OSError:
        return False


def age_text(seconds: float) -> str:
    """A time as people say it: `12 s`, `3 min`, `5 h`, `12 days`."""
    for unit, length, least in (('days', 86400, 2 * 86400), ('h', 3600, 7200), ('min', 60, 120)):
        if seconds >= least:
            return f'{seconds / length:.0f} {unit}'
    return f'{seconds:.0f} s'
