"""Pages of the documentation, followed as a reader would: files are saved, commands are typed, sessions are run.

A block of a page is one of these:

- a file: the line before it ends with the file's name, as in "Save it as `talker.py`:"; it is written;
- ```console: a line that begins with `$ ` is typed into bash, what follows is what the terminal must show, where `...`
  stands for anything; a command that ends with & goes on in the background; RViz, which needs somebody, is left out;
- ```diff FILE: a change of a file that is there already; it is made;
- ```python of FILE: a part of such a file, which has to be in it;
- ```python with >>>: a session, checked by doctest.
"""

import doctest
import os
import re
import signal
import subprocess
import sys
import time

from support.shell import shown_on_terminal

BLOCK = re.compile(r'^([^\n]*)\n+```(\w*(?: [\w. ]+)?|\{[^\n]*)\n(.*?)^```$', re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r'^\{')
ESCAPES = re.compile(r'\x1b\[[^a-zA-Z]*[a-zA-Z]|\x1b\][^\a]*\a')
# What has been written over since: a progress bar.
OVERWRITTEN = re.compile(r'[^\r\n]*\r')
# What rospy warns of while the machine is busy is no part of a page.
WARNINGS = re.compile(r'^\[WARN\] \[[^\n]*\n', re.MULTILINE)
PATIENCE = 60.0  # seconds for what a command shows to come true, on a busy machine


def blocks(text):
    """[(line before, language, content)] of the blocks that are code."""
    return [found for found in BLOCK.findall(text) if not DIRECTIVE.match(found[1])]


class Reader:
    """Plays the blocks of one page in a folder; whatever it started is ended with it.

    Args:
        folder: an empty one.
    """

    def __init__(self, folder):
        self._folder = folder
        self._background = []

    def play(self, text):
        """Play all blocks of a page."""
        for before, language, content in blocks(text):
            if language == 'console':
                self._type(content)
            elif '>>>' in content:
                hold_session(content)
            elif language.startswith('diff '):
                self._change(language.split()[-1], content)
            elif ' of ' in language:
                assert content in (self._folder / language.split()[-1]).read_text(encoding='utf-8')
            else:
                self._save(before, content)

    def _save(self, before, content):
        names = re.findall(r'`([^` ]+\.\w+)`[^`]*:$', before)
        assert names, f'this block is neither a file, a console nor a session:\n{before}\n{content}'
        path = self._folder / names[-1]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding='utf-8')

    def _change(self, name, content):
        lines = content.splitlines(keepends=True)
        before = ''.join(line[1:] or '\n' for line in lines if line[:1] != '+')
        after = ''.join(line[1:] or '\n' for line in lines if line[:1] != '-')
        path = self._folder / name
        text = path.read_text(encoding='utf-8')
        assert text.count(before) == 1, f'{name} does not have this, or more than once:\n{before}'
        path.write_text(text.replace(before, after), encoding='utf-8')

    def _type(self, content):
        for step in re.split(r'^\$ ', content, flags=re.MULTILINE)[1:]:
            command, _, expected = step.partition('\n')
            if command.endswith('&'):
                command = ['bash', '-c', command[:-1]]
                started = subprocess.Popen(
                    command, cwd=str(self._folder), start_new_session=True, stdout=subprocess.DEVNULL
                )
                self._background.append(started)
            elif command != 'roslaunch rosslt rviz.launch':
                self._check(command, expected)

    def _check(self, command, expected):
        pattern = r'[\s\S]*?'.join(map(re.escape, expected.rstrip().split('...')))
        deadline = time.monotonic() + PATIENCE
        while True:
            status, shown = self._shown(command)
            if re.fullmatch(pattern, shown.rstrip()):
                return
            # a node that was started above may still be on its way; but what has changed something says so only once
            is_done = status == 0 and re.search(r'rosslt (set|force|undo|reset)', command)
            if is_done or time.monotonic() > deadline:
                raise AssertionError(f'$ {command}\n{shown}\ninstead of\n{expected}')
            time.sleep(0.2)

    def _shown(self, command):
        """The exit status of a command, and what a terminal shows of it."""
        status, shown = shown_on_terminal(['bash', '-c', command], cwd=str(self._folder), start_new_session=True)
        return status, WARNINGS.sub('', OVERWRITTEN.sub('', ESCAPES.sub('', shown)))

    def close(self):
        """End what still runs."""
        for process in self._background:
            try:
                os.killpg(process.pid, signal.SIGINT)
                process.wait(60)
            except ProcessLookupError:
                pass
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def hold_session(content):
    """Check a session with >>>; the sessions of a page share nothing but what they import and say themselves."""
    session = doctest.DocTestParser().get_doctest(content, sessions, 'session', 'page', 0)
    runner = doctest.DocTestRunner(optionflags=doctest.IGNORE_EXCEPTION_DETAIL)
    assert runner.run(session, out=sys.stderr.write, clear_globs=False).failed == 0
    sessions.update(session.globs)


#: What the sessions of a page have defined so far.
sessions = {}
