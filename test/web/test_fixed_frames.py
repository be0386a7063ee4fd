"""The fixed frames of a robot under `rosslt launch` are dragged on the page."""

import os
import re

import pytest

from support.packages import launched

pytestmark = pytest.mark.rostest

URDF = """<robot name="stand">
  <link name="world"/> <link name="camera"/>
  <joint name="mount" type="fixed"><parent link="world"/><child link="camera"/><origin xyz="0 0 0" rpy="0 0 0"/></joint>
</robot>
"""
LAUNCHED = """<launch>
  <param name="robot_description" textfile="$(dirname)/stand.urdf"/>
  <node pkg="robot_state_publisher" type="robot_state_publisher" name="publisher"/>
</launch>
"""
ARROW = 80  # from the middle of the frame to the head of its arrow, in pixels
NEAR = 0.2  # metres: what a mouse misses by


def test_an_arrow_moves_a_fixed_frame(master, browser, tmp_path):
    file = tmp_path / 'stand.launch'
    file.write_text(LAUNCHED)
    (tmp_path / 'stand.urdf').write_text(URDF)

    def numbers(attribute):
        text = master.getParam('/robot_description')
        return [float(one) for one in re.search(rf'{attribute}="([^"]*)"', text)[1].split()]

    with launched(dict(os.environ), 'rosslt', 'launch', '--no-markers', str(file)):
        browser.see((0.05, 0.0, 0.0))
        out = ARROW * browser.metres((0.0, 0.0, 0.0))
        browser.drag_until(
            lambda: abs(numbers('xyz')[0] - 1.0) < NEAR,
            lambda: (numbers('xyz')[0] + out, 0.0, 0.0),
            (1.0 + out, 0.0, 0.0),
            'the arrow moves the frame',
        )
        browser.picture('fixed frame')
        assert numbers('xyz')[1:] == [0.0, 0.0]
        assert numbers('rpy') == [0.0, 0.0, 0.0]
        browser.see((numbers('xyz')[0] + 0.05, 0.0, 0.0))
    master.deleteParam('/robot_description')
