"""What ends the command with exit code 1."""


class Failure(Exception):
    """It did not work; the text says why, in one line."""
