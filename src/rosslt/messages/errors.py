"""Exceptions for faulty messages and message types. Users meet them as `rosslt.BadHeader` and the like."""

from rosslt.values import Error


class BadHeader(Error):
    """The provenance of a message is not right; the error says what was found where. The message is as it was."""

    __module__ = 'rosslt'


class UnknownType(Error):
    """No definition of a message type was found, or none that can be read; the error says where it was looked for."""

    __module__ = 'rosslt'
