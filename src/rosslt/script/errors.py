"""What can be wrong with a script, and where: what can be with any text file."""

from rosslt.files import FileError

#: A script, or a change of one, that cannot come into force.
ScriptError = FileError
