"""The exceptions that end the command with an error."""


class Failure(Exception):
    """The command failed: exit code 1. The text says why, in one line."""


class Misused(Exception):
    """The arguments do not fit together: exit code 2, as for those that the parser refuses."""
