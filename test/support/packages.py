"""Packages of one node each, for launch files, and these files as they run."""

import contextlib
import os
import signal
import subprocess

_MANIFEST = (
    '<package><name>{}</name><version>1.0.0</version><description>d</description>'
    '<maintainer email="a@b.c">a</maintainer><license>BSD</license></package>'
)


def package_of_node(folder, name, file, code):
    """Write a package; returns the environment in which it is found.

    Args:
        code: all of the file but the first line, which says that Python runs it.
    """
    package = folder / name
    package.mkdir()
    (package / 'package.xml').write_text(_MANIFEST.format(name))
    script = package / file
    script.write_text('#!/usr/bin/env python3\n' + code, encoding='utf-8')
    script.chmod(0o755)
    return dict(os.environ, ROS_PACKAGE_PATH=f'{folder}:{os.environ["ROS_PACKAGE_PATH"]}')


@contextlib.contextmanager
def launched(environment, *words):
    """A launch file that runs by a command as long as the context lasts."""
    process = subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)
