"""What a person chooses for the drags of a thing, and what its drags change then."""

import pytest
from visualization_msgs.msg import Marker

from rosslt import values
from rosslt.markers.describing import Descriptions
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.offers import Offers
from rosslt.markers.scene.handle import Settings
from rosslt.markers.scene.scene import Scene
from support.processes import wait_until

POST, NEXT_POST, OFFSET = ([values.Source('/guard', 10 * row + axis) for axis in range(2)] for row in range(3))
NAME = '/posts::0'


def at(x, y):
    return (x, y, 0.0, 0.0, 0.0, 0.0, 1.0)


def name_of(source):
    rows = {'post': POST, 'next': NEXT_POST, 'offset': OFFSET}
    return next(f'{row} {"xy"[sources.index(source)]}' for row, sources in rows.items() if source in sources)


class Patrol:
    """A thing at (1, 2) that is at a post, shifted by what all posts share; and hands on it.

    Attributes:
        said: the texts at the thing.
    """

    def __init__(self):
        self.scene, self.said = Scene(Settings()), []
        self.drags = Drags(self.scene, Rules(is_live=False), name_of)
        self.offers = Offers(self.scene, self.drags, Descriptions())
        self.go_to(POST)

    def go_to(self, post):
        marker = Marker(type=Marker.CUBE)
        marker.header.frame_id = 'world'
        marker.pose.position.x = values.track(1.0, post[0]) + values.track(0.0, OFFSET[0])
        marker.pose.position.y = values.track(2.0, post[1]) + values.track(0.0, OFFSET[1])
        marker._connection_header = {'callerid': '/guard'}
        self.scene.take('/posts', marker, is_shown=True)

    def choose(self, *sources):
        for source in sources:
            self.offers.choose(self.scene.handle(NAME), source)

    @property
    def chosen(self):
        handle = self.scene.handle(NAME)
        return [choice.source for choice in self.offers.choices(handle) if self.offers.is_chosen(handle, choice)]

    def drag(self, x, y):
        """Drag the thing; what is said once the hand has let go."""
        assert self.drags.hold(NAME, frame='world', pose=at(1.0, 2.0))
        assert self.drags.release(NAME, 'world', at(x, y))
        wait_until(self._hear, 'the hand to be told')
        return self.said[-1]

    def _hear(self):
        heard = [text for _, text in self.scene.news().said]
        self.said += heard
        return heard


@pytest.fixture
def patrol():
    return Patrol()


def test_a_choice_moves_a_thing_only_as_far_as_it_reaches(asked, patrol):
    patrol.choose(OFFSET[0])
    assert patrol.drag(1.5, 3.0) == 'chosen: offset x; the rest stays'
    assert asked == [{OFFSET[0]: 0.5}]


def test_a_choice_that_reaches_nothing_that_was_moved_says_so(asked, patrol):
    patrol.choose(OFFSET[0])
    assert patrol.drag(1.0, 3.0) == 'chosen: offset x; the rest stays'
    assert asked == []


def test_a_pair_is_chosen_one_after_the_other(asked, patrol):
    patrol.choose(*OFFSET)
    assert patrol.chosen == OFFSET
    patrol.drags.hold(NAME, frame='world', pose=at(1.0, 2.0))
    patrol.drags.release(NAME, 'world', at(1.5, 3.0))
    wait_until(lambda: asked == [{OFFSET[0]: 0.5, OFFSET[1]: 1.0}], 'both to change')


def test_choices_are_taken_back_one_by_one_or_together(patrol):
    patrol.choose(*OFFSET, OFFSET[0])
    assert patrol.chosen == [OFFSET[1]]
    patrol.choose(OFFSET[0], POST[1])
    assert set(patrol.chosen) == {OFFSET[0], POST[1]}, 'one that does the same takes the place of another'
    patrol.choose(None)
    assert patrol.chosen == [None]


def test_a_choice_is_of_things_that_come_from_it(asked, patrol):
    patrol.choose(POST[0], OFFSET[1])
    patrol.go_to(NEXT_POST)
    assert patrol.chosen == [None]
    assert patrol.drag(1.5, 2.0) == 'it does not come from post x, offset y now: a drag changes next x'
    assert asked == [{NEXT_POST[0]: 1.5}]
    patrol.go_to(POST)
    assert set(patrol.chosen) == {POST[0], OFFSET[1]}


def test_what_the_next_target_comes_from_too_stays_chosen(asked, patrol):
    patrol.choose(OFFSET[0])
    patrol.go_to(NEXT_POST)
    assert patrol.chosen == [OFFSET[0]]
    assert patrol.drag(1.5, 3.0) == 'chosen: offset x; the rest stays'
    assert asked == [{OFFSET[0]: 0.5}]
