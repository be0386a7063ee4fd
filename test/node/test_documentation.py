"""What the README and docs/nodes.md show is what happens."""

import doctest
import re
import subprocess
import sys
from pathlib import Path

import pytest
import rosgraph

from support.processes import wait_until

ROOT = Path(__file__).resolve().parents[2]


def blocks(page, language):
    """The code blocks of a page in a language."""
    return re.findall(r'```{}\n(.*?)```'.format(language), (ROOT / page).read_text(encoding='utf-8'), re.DOTALL)


@pytest.fixture
def run(tmp_path, master):
    """Starts scripts as processes, and ends them with the test."""
    started = []

    def start(name, code):
        path = tmp_path / (name + '.py')
        path.write_text(code, encoding='utf-8')
        started.append(
            subprocess.Popen([sys.executable, str(path)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        )
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def parameter(name):
    """A parameter, None where it is not set."""
    try:
        return rosgraph.Master('/test').getParam(name)
    except rosgraph.MasterError:
        return None


def echoed(topic):
    """The next message on a topic, as rostopic shows it."""
    return subprocess.run(
        ['rostopic', 'echo', '-n', '1', topic], check=True, stdout=subprocess.PIPE, text=True, timeout=30
    ).stdout


def test_the_session_of_the_readme():
    session = doctest.DocTestParser().get_doctest(
        '\n'.join(blocks('README.md', 'python')[:1]), {}, 'README.md', 'README.md', 0
    )
    assert session.examples
    assert doctest.DocTestRunner(optionflags=doctest.IGNORE_EXCEPTION_DETAIL).run(session).failed == 0


@pytest.mark.rostest
def test_the_publisher_and_the_subscriber_of_the_readme(run):
    _, publisher, subscriber = blocks('README.md', 'python')
    run('talker', publisher)
    listener = run('listener', subscriber)
    output, _ = listener.communicate(timeout=60)
    assert listener.returncode == 0, output
    assert re.search(r'100 \* 1\.5 \[.*\] \+ 20 is 170.0', output), output
    assert 'now 320.0' in output
    assert parameter('/talker/rosslt/reach') == 3.0


@pytest.mark.rostest
def test_the_plain_talker_of_the_page_on_nodes_and_its_tracked_twin(run):
    lines = blocks('docs/nodes.md', 'diff')[0].splitlines()
    plain = '\n'.join(line[1:] for line in lines if not line.startswith('+'))
    tracked = '\n'.join(line[1:] for line in lines if not line.startswith('-'))
    assert 'rosslt' not in plain
    process = run('plain_talker', plain)
    assert 'frame_id: "world"' in echoed('/target')
    process.kill()
    process.wait()
    run('talker', tracked)
    assert 'frame_id: "world"' in echoed('/target')
    assert wait_until(lambda: parameter('/talker/rosslt/radius'), 'the radius is a parameter') == 2.0
    ask = """
import rospy, rosslt, math
from geometry_msgs.msg import PoseStamped
rosslt.init_node('asker')
target = rosslt.wait_for_message('target', PoseStamped, timeout=60.0).pose.position
rosslt.force_value(target, rosslt.evaluate(target, {rosslt.sources(target)[0]: 3.0}))
print(rosslt.explain(target.x))
"""
    asker = run('asker', ask)
    output, _ = asker.communicate(timeout=60)
    assert asker.returncode == 0, output
    assert re.search(r'0\.\d+ \* 2\.0 \[radius, talker\.py:29:22\]', output), output
    wait_until(lambda: parameter('/talker/rosslt/radius') == 3.0, 'the radius is changed')
