"""What the RViz configurations show when they open."""

import math
import re
from pathlib import Path

import pytest
import yaml

from rosslt.markers.geometry import distance

CONFIG = Path(__file__).resolve().parents[2] / 'config'
CONFIGURATIONS = sorted(CONFIG.glob('*.rviz'))
FIELD_OF_VIEW = math.radians(45.0)  # of RViz's cameras, from top to bottom
BARS = 140  # pixels of menus, tools and status
MARGIN = 0.95


@pytest.mark.parametrize('path', CONFIGURATIONS, ids=lambda path: path.name)
def test_the_window_opens_with_its_title_bar_on_the_screen(path):
    window = yaml.safe_load(path.read_text())['Window Geometry']
    assert window['X'] >= 20
    assert window['Y'] >= 40


def waypoints():
    """Where config/waypoints.script flies to."""
    text = (CONFIG / 'waypoints.script').read_text()
    height = float(re.search(r'^height = (.*)$', text, flags=re.MULTILINE).group(1))
    calls = re.findall(r'^goto\((.*)\)$', text, flags=re.MULTILINE)
    assert calls
    return [[eval(part, {'height': height}) for part in call.split(',')] for call in calls]


@pytest.mark.parametrize('point', waypoints(), ids=str)
def test_the_camera_of_the_demo_shows_every_waypoint(point):
    configuration = yaml.safe_load((CONFIG / 'demo.rviz').read_text())
    view, window = configuration['Visualization Manager']['Views']['Current'], configuration['Window Geometry']
    yaw, pitch, away = view['Yaw'], view['Pitch'], view['Distance']
    focus = [view['Focal Point'][axis] for axis in 'XYZ']
    out = (math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), math.sin(pitch))
    right = (-math.sin(yaw), math.cos(yaw), 0.0)
    up = (-math.cos(yaw) * math.sin(pitch), -math.sin(yaw) * math.sin(pitch), math.cos(pitch))
    eye = [part + away * direction for part, direction in zip(focus, out)]
    way = [a - b for a, b in zip(point, eye)]

    def along(direction):
        return sum(a * b for a, b in zip(way, direction))

    depth = -along(out)
    assert 0.0 < depth <= distance(point, eye)
    half = math.tan(FIELD_OF_VIEW / 2) * depth * MARGIN
    assert abs(along(up)) < half
    assert abs(along(right)) < half * window['Width'] / (window['Height'] - BARS)
