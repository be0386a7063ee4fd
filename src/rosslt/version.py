"""The version of the package, which stands in package.xml alone."""

import re
from pathlib import Path
from typing import Iterable

MANIFESTS = ('../../package.xml', '../../../../share/rosslt/package.xml')
"""Where package.xml is, seen from the package's folder: in the source space, and in an install space."""


def find_version(folders: Iterable[str]) -> str:
    """The version in package.xml.

    Args:
        folders: where the package's modules are.

    Raises:
        RuntimeError: none of them belongs to a source space or an install space.
    """
    for folder in folders:
        for manifest in MANIFESTS:
            path = Path(folder).resolve() / manifest
            if path.is_file():
                found = re.search('<name>rosslt</name>.*?<version>(.*?)</version>', path.read_text('utf-8'), re.DOTALL)
                if found:
                    return found.group(1)
    raise RuntimeError('no package.xml of rosslt near %s' % ', '.join(folders))
