"""What ends the command without success."""


class Failure(Exception):
    """It did not work: exit code 1. The text says why, in one line."""


class Misused(Exception):
    """The arguments do not fit together: exit code 2, as for those that the parser refuses."""
