"""What recording costs programs that compute: the CPU time of those in `programs/`, plain and under `rosslt run`.

Each is a small program from a textbook (filters, planners, controllers) that checks its own result. The time of imports
is not counted, and NumPy computes in one thread: several take more CPU time for the same. The last column is the time
that may be taken at most: 3 times the plain one and 0.4 s.
"""

import argparse
import os
import pathlib
import subprocess
import sys

PROGRAMS = pathlib.Path(__file__).resolve().parent / 'programs'
FACTOR, MORE = 3.0, 0.4
TIMEOUT = 300.0


def cpu_of(command, path):
    """The CPU time that a program prints, in seconds."""
    done = subprocess.run(
        [*command, str(path)],
        env={**os.environ, 'OMP_NUM_THREADS': '1'},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    if done.returncode:
        raise SystemExit(f'{path.name}: {done.stderr[-2000:]}')
    return float(done.stdout.split('cpu ')[1].split()[0])


def main():
    """Run the programs that are named, all without a name."""
    names = sorted(path.stem for path in PROGRAMS.glob('*.py') if path.stem != 'running')
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('names', nargs='*', choices=[[], *names], metavar='NAME', help=', '.join(names))
    print(f'{"program":<18}{"plain":>8}{"tracked":>9}{"times":>7}{"limit":>8}  s of CPU')
    for name in parser.parse_args().names or names:
        path = PROGRAMS / f'{name}.py'
        plain = cpu_of([sys.executable], path)
        tracked = cpu_of(['rosslt', 'run'], path)
        limit = FACTOR * plain + MORE
        mark = '' if tracked <= limit else '  !'
        print(f'{name:<18}{plain:8.2f}{tracked:9.2f}{tracked / plain:7.1f}{limit:8.2f}{mark}', flush=True)


if __name__ == '__main__':
    main()
