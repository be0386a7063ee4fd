"""Warnings name the line of the node that they are about, as they do if nothing is tracked."""

import sys
import warnings
from typing import Any, Optional, Sequence, TextIO, Type, Union


def name_lines_of_node(ours: Sequence[str]) -> None:
    """Have warnings in functions called on behalf of a node name the node's line, as often as the filters say.

    Args:
        ours: the folders of the files that call functions on behalf of the node.
    """
    folders, shown = tuple(ours), warnings.showwarning

    def showwarning(
        message: Union[Warning, str],
        category: Type[Warning],
        filename: str,
        lineno: int,
        file: Optional[TextIO] = None,
        line: Optional[str] = None,
    ) -> None:
        """Override the function of `warnings`."""
        frame: Any = sys._getframe() if filename.startswith(folders) else None
        while frame is not None and frame.f_code.co_filename.startswith((*folders, warnings.__file__)):
            # Python would remember our line, and not warn of the node's next line.
            frame.f_globals.get('__warningregistry__', {}).clear()
            frame = frame.f_back
        if frame is None:
            shown(message, category, filename, lineno, file, line)
            return
        names = frame.f_globals
        registry = names.setdefault('__warningregistry__', {})
        path, module = frame.f_code.co_filename, names.get('__name__')
        warnings.warn_explicit(message, category, path, frame.f_lineno, module, registry)

    warnings.showwarning = showwarning
