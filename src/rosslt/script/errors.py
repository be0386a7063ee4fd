"""The error of a script: that of any text file."""

from rosslt.files import FileError

#: A script, or a change of one, that cannot come into force.
ScriptError = FileError
