"""Exceptions of tracked values; every exception of the package derives from `Error`."""


class Error(Exception):
    """The base of all errors of rosslt."""

    __module__ = 'rosslt'  # where users import it from, so that tracebacks and pickles say that name


class NotTracked(Error):
    """A value without a source was given if one with a source is needed."""

    __module__ = 'rosslt'


class NotInvertible(Error):
    """No value of the sources gives the wanted result; the message names the operation and why."""

    __module__ = 'rosslt'
