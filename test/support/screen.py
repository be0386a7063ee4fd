"""A virtual screen with RViz and a mouse on it."""

import os
import pathlib
import shutil
import subprocess

import numpy

from support.hand import wait_until

SIZE = (1000, 800)
STARTING = 60.0
STOPPING = 5.0

#: Screenshots are kept here, to be looked at after the tests.
SCREENSHOTS = pathlib.Path(
    os.environ.get('ROSSLT_SCREENSHOTS') or pathlib.Path(__file__).resolve().parents[2] / 'build' / 'screenshots'
)


class Screen:
    """Xvfb, openbox and RViz, with a view from above.

    Args:
        config: the RViz configuration.
    """

    def __init__(self, config):
        self._processes = []
        read_end, write_end = os.pipe()
        # Without -noreset, it begins anew when its last client has gone, and takes the window manager with it.
        options = '-displayfd {} -noreset -screen 0 {}x{}x24 +extension GLX'.format(write_end, *SIZE)
        self._start(['Xvfb', *options.split()], pass_fds=[write_end])
        os.close(write_end)
        with os.fdopen(read_end) as pipe:
            number = pipe.readline().strip()
        if not number:
            raise RuntimeError('Xvfb did not start')
        self._environment = dict(os.environ, DISPLAY=':' + number, LIBGL_ALWAYS_SOFTWARE='1')
        self._start(['openbox'])
        self._config = config
        self.start_rviz()
        self.await_rviz()
        self.origin = self.scale = None

    def start_rviz(self):
        """Start RViz; its window comes once there is a master."""
        self._rviz = self._start(['rviz', '-d', self._config])

    def await_rviz(self):
        """Wait for RViz's window, and have it fill the screen."""
        wait_until(self._is_placed, 'the window of RViz', STARTING)

    def kill_rviz(self):
        self._processes.remove(self._rviz)
        self._rviz.kill()
        self._rviz.wait()

    def _is_placed(self):
        """Have RViz's window fill the screen; False where it is not there yet, or only the splash screen."""
        windows = self._xdotool('search', '--onlyvisible', '--name', r'\.rviz\*? - RViz', is_checked=False).split()
        if not windows:
            return False
        place = ['windowmove', windows[-1], '0', '0', 'windowsize', windows[-1], *map(str, SIZE)]
        moved = subprocess.run(['xdotool', *place], env=self._environment, check=False, timeout=STARTING)
        return moved.returncode == 0

    def close(self):
        for process in reversed(self._processes):
            process.terminate()
        for process in reversed(self._processes):
            try:
                process.wait(STOPPING)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def calibrate(self, color, first, second):
        """Calibrate pixels to metres, by the only two spots of a color.

        Args:
            color: (red, green, blue), 0 to 255.
            first, second: where they are, (x, y) in metres; x grows to the right and y upwards.
        """

        def spots():
            found = self._find(color)
            if len(found) < 8:
                return None
            # Far apart, as they are, the middle between the outermost pixels tells them apart.
            is_left = found[:, 0] < (found[:, 0].min() + found[:, 0].max()) / 2
            spots = found[is_left].mean(axis=0), found[~is_left].mean(axis=0)
            return spots if numpy.linalg.norm(spots[0] - spots[1]) > 100 else None

        left, right = wait_until(spots, 'two spots of the color {}'.format(color), STARTING)
        if first[0] > second[0]:
            first, second = second, first
        self.scale = (right[0] - left[0]) / (second[0] - first[0])
        other_scale = (left[1] - right[1]) / (second[1] - first[1])
        if abs(self.scale - other_scale) > 1.0:
            raise RuntimeError('{} pixels a metre to the right, {} upwards'.format(self.scale, other_scale))
        self.origin = (left[0] - self.scale * first[0], left[1] + self.scale * first[1])

    def pixel(self, x, y):
        """Where a place in the plane is on the screen."""
        return round(self.origin[0] + self.scale * x), round(self.origin[1] - self.scale * y)

    def place(self, pixel):
        """The place in the plane that is at a pixel, the other way round."""
        return (pixel[0] - self.origin[0]) / self.scale, (self.origin[1] - pixel[1]) / self.scale

    def press(self, button=1):
        self._xdotool('mousedown', str(button))

    def release(self, button=1):
        self._xdotool('mouseup', str(button))

    def move(self, path, step_time=0.03):
        """Move the mouse along pixels."""
        arguments = []
        for pixel in path:
            arguments.extend(['mousemove', *map(str, pixel), 'sleep', str(step_time)])
        self._xdotool(*arguments)

    def screenshot(self, name):
        """Keep a picture of the screen."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        self._run(['import', '-window', 'root', str(SCREENSHOTS / (name + '.png'))])

    def color(self, pixel):
        """(red, green, blue) of a pixel."""
        return tuple(map(int, self._pixels()[pixel[1], pixel[0]]))

    def count(self, color, left, top, right, bottom):
        """How many pixels in a box are about of a color."""
        found = self._find(color, 30)
        return int(((found >= (left, top)) & (found < (right, bottom))).all(axis=1).sum())

    def middle(self, color):
        """The middle (right, down) of the pixels that are about of a color; None where there are few."""
        found = self._find(color, 40)
        return tuple(map(round, found.mean(axis=0))) if len(found) > 100 else None

    def picture(self, box):
        """The pixels between left, top, right and bottom, to be compared."""
        left, top, right, bottom = box
        return self._pixels()[top:bottom, left:right].tobytes()

    def _find(self, color, tolerance=0):
        """The pixels of a color, [(right, down)]."""
        near = abs(self._pixels().astype(int) - numpy.array(color)).max(axis=2) <= tolerance
        return numpy.argwhere(near)[:, ::-1]

    def _pixels(self):
        data = self._run(['import', '-window', 'root', '-depth', '8', 'rgb:-'])
        return numpy.frombuffer(data, dtype=numpy.uint8).reshape(SIZE[1], SIZE[0], 3)

    def _xdotool(self, *arguments, is_checked=True):
        return self._run(['xdotool', *arguments], is_checked).decode()

    def _run(self, command, is_checked=True):
        return subprocess.run(
            command, env=self._environment, stdout=subprocess.PIPE, check=is_checked, timeout=STARTING
        ).stdout

    def _start(self, command, **options):
        if shutil.which(command[0]) is None:
            raise RuntimeError('{} is not installed'.format(command[0]))
        process = subprocess.Popen(
            command,
            env=getattr(self, '_environment', None),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            **options,
        )
        self._processes.append(process)
        return process
