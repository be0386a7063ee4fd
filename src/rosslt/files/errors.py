"""The error of a text file, or of a change of one, with its position."""

import os
from typing import Optional

from rosslt import values


class FileError(values.Error):
    """A text file, or a change of one, that cannot be taken.

    Attributes:
        file: its path.
        line, column: where, from 1; None if it concerns the file as a whole.
        reason: why.
    """

    def __init__(self, file: str, line: Optional[int], column: Optional[int], reason: str) -> None:
        self.file, self.line, self.column, self.reason = file, line, column, reason
        super().__init__(self._told(file))

    @property
    def brief(self) -> str:
        """Its text, with the name of the file for its path."""
        return self._told(os.path.basename(self.file))

    def _told(self, file: str) -> str:
        place = file if self.line is None else '{}:{}:{}'.format(file, self.line, self.column)
        return '{}: {}'.format(place, self.reason)
