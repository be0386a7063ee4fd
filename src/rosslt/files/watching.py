"""Watches files: what others write into them is heard of, however they do it."""

import os
import threading
from typing import Callable, Set

from watchdog.events import FileSystemEvent, FileSystemEventHandler
from watchdog.observers import Observer

#: What watchdog reports when somebody has written; newer versions report who reads, too.
WRITTEN = frozenset(['created', 'modified', 'moved', 'closed', 'deleted'])


class _Handler(FileSystemEventHandler):
    """Hands on what watchdog reports."""

    def __init__(self, take: Callable[[FileSystemEvent], None]) -> None:
        self._take = take

    def on_any_event(self, event: FileSystemEvent) -> None:
        self._take(event)


class FileWatch:
    """Calls a function when a file may have been written, whoever did it and however; from a thread of its own.

    Args:
        path: the file. What matters happens in its folder: editors write a new file, and give it the old name.
        changed: called without arguments.
    """

    def __init__(self, path: str, changed: Callable[[], object]) -> None:
        self._names: Set[str] = set()
        self._folders: Set[str] = set()
        self._changed = changed
        self._written = threading.Event()
        self._handler = _Handler(self._note)
        self._observer = Observer()
        self.add(path)
        self._observer.start()
        threading.Thread(target=self._work, name='watch', daemon=True).start()

    def add(self, path: str) -> None:
        """FileWatch another file, too."""
        names = {os.path.abspath(path), os.path.realpath(path)}
        self._names |= names
        for folder in {os.path.dirname(name) for name in names} - self._folders:
            self._folders.add(folder)
            self._observer.schedule(self._handler, folder)

    def _note(self, event: FileSystemEvent) -> None:
        paths = {
            os.path.abspath(os.fsdecode(path)) for path in (event.src_path, getattr(event, 'dest_path', '')) if path
        }
        if event.event_type in WRITTEN and paths & self._names:
            self._written.set()

    def _work(self) -> None:
        while True:
            self._written.wait()
            self._written.clear()
            self._changed()
