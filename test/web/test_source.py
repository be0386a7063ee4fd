"""The source beside the view, in a real browser."""

import signal

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from support.browser import PATIENCE, Server
from support.panel import Panel
from support.processes import Node, wait_until
from support.scenery import marker_node, value
from support.shell import rosslt
from support.unmodified import Unmodified

pytestmark = pytest.mark.rostest

LAMP = marker_node(
    'lamp',
    'SPHERE',
    0.8,
    'b',
    """
    x = rosslt.location(-2.00, name='east', minimum=-4.0, maximum=4.0)
    y = rosslt.location(1.0, name='north')
    marker.pose.position.x, marker.pose.position.y = x, y
    marker.pose.position.z = rosslt.location(getter=lambda: up[-1], setter=up.append, name='up')
    rosslt.location(2.0, name='fixed', read_only=True)
    rosslt.location(7.5, name='unused')
    """,
    'up = [0.0]',
)
PLACE = (-2.0, 1.0, 0.0)  # where viser's column of fields does not hide it


@pytest.fixture(scope='module')
def lamp(master):
    with Node('lamp', LAMP) as node:
        yield node


@pytest.fixture
def panel(lamp, page, browser):
    """The panel with the file of the lamp, as the code has it."""
    rosslt('reset', '/lamp')
    browser.open(page.url)
    shown = Panel(browser)
    shown.open('lamp.py')
    shown.shows('/lamp/east', '-2.00')
    yield shown
    browser.driver.switch_to.default_content()
    browser.open(page.view)


def has_become(name, expected):
    wait_until(lambda: value(name) == expected, f'{name} is {expected}', PATIENCE)


def test_a_number_stands_in_its_line_and_can_be_typed(panel):
    assert "rosslt.location(-2.00, name='east'" in panel.line_of('/lamp/east')
    panel.type('/lamp/east', Keys.CONTROL, 'a', Keys.NULL, '1.5', Keys.ENTER)
    has_become('/lamp/east', 1.5)
    panel.shows('/lamp/east', '1.50')
    panel.browser.picture('source')
    assert panel.driver.find_element('css selector', '.changed + s').text == '-2.00'


def test_what_is_typed_after_enter_takes_the_place_of_the_number(panel):
    panel.type('/lamp/east', Keys.CONTROL, 'a', Keys.NULL, '1.5', Keys.ENTER)
    panel.shows('/lamp/east', '1.50')
    ActionChains(panel.driver).send_keys('2', Keys.ENTER).perform()
    has_become('/lamp/east', 2.0)
    panel.shows('/lamp/east', '2.00')
    ActionChains(panel.driver).click(panel.box('/lamp/east')).send_keys('3', Keys.ENTER).perform()
    has_become('/lamp/east', 3.0)


def test_the_next_one_is_a_tab_away_and_arrows_step_the_last_digit(panel):
    panel.type('/lamp/east', Keys.ARROW_UP, Keys.ARROW_UP, Keys.TAB, Keys.ARROW_DOWN)
    has_become('/lamp/east', -1.98)
    has_become('/lamp/north', 0.9)


def test_escape_gives_up_what_was_typed(panel):
    panel.type('/lamp/north', '5', Keys.ESCAPE)
    panel.shows('/lamp/north', '1.0')
    assert value('/lamp/north') == 1.0


def test_what_is_no_number_is_said_and_the_one_in_force_comes_back(panel):
    panel.type('/lamp/north', Keys.CONTROL, 'a', Keys.NULL, 'abc', Keys.ENTER)
    panel.says("'abc' is not a number")
    panel.shows('/lamp/north', '1.0')


def test_a_refusal_is_said_and_the_one_in_force_comes_back(panel):
    panel.type('/lamp/east', Keys.CONTROL, 'a', Keys.NULL, '9', Keys.ENTER)
    panel.says('above its maximum 4.0')
    panel.shows('/lamp/east', '-2.00')
    assert value('/lamp/east') == -2.0


def test_texts_and_truth_values_in_code_are_within_their_quotes(panel, talker):
    panel.open('talker.py')
    assert panel.line_of('/talker/place').strip() == "rosslt.location('home', name='place')"
    panel.type('/talker/place', Keys.CONTROL, 'a', Keys.NULL, "it's", Keys.ENTER)
    has_become('/talker/place', "it's")
    panel.box('/talker/is_on').click()
    panel.shows('/talker/is_on', 'False')
    panel.shows_former('/talker/place', 'home')
    panel.shows_former('/talker/is_on', 'True')
    rosslt('reset', '/talker')
    panel.shows('/talker/place', 'home')
    panel.shows('/talker/is_on', 'True')


def test_a_read_only_number_takes_nothing(panel):
    panel.type('/lamp/fixed', '9', Keys.ARROW_UP, Keys.ENTER)
    panel.scrub('/lamp/fixed', 40)
    panel.type('/lamp/unused', Keys.ARROW_UP)
    has_become('/lamp/unused', 7.6)
    panel.shows('/lamp/fixed', '2.0')
    assert 'it takes no change' in panel.box('/lamp/fixed').get_attribute('title')


def test_a_drag_over_a_number_moves_it_and_is_undone_as_one(panel):
    panel.type('/lamp/east', Keys.CONTROL, 'a', Keys.NULL, '1.25', Keys.ENTER, Keys.ESCAPE)
    has_become('/lamp/east', 1.25)
    panel.scrub('/lamp/east', 80)
    wait_until(lambda: value('/lamp/east') > 1.25, 'it follows', PATIENCE)
    has_become('/lamp/east', 1.45)
    panel.shows('/lamp/east', '1.45')
    panel.scrub('/lamp/east', -40)
    has_become('/lamp/east', 1.35)
    rosslt('undo', '/lamp')
    panel.shows('/lamp/east', '1.45')
    rosslt('undo', '/lamp')
    panel.shows('/lamp/east', '1.25')


def test_a_drag_stops_at_the_bounds(panel):
    panel.type('/lamp/east', Keys.CONTROL, 'a', Keys.NULL, '3.95', Keys.ENTER, Keys.ESCAPE)
    has_become('/lamp/east', 3.95)
    panel.shows('/lamp/east', '3.95')
    panel.scrub('/lamp/east', 80)
    has_become('/lamp/east', 4.0)


def test_a_change_from_elsewhere_is_seen_beside_the_literal(panel):
    rosslt('set', '/lamp/north', '--', '-2.75')
    panel.shows('/lamp/north', '-2.75')
    assert panel.driver.find_element('css selector', '.changed + s').text == '1.0'
    rosslt('undo', '/lamp')
    panel.shows('/lamp/north', '1.0')
    assert not panel.driver.find_elements('css selector', '.changed')


def yellow(panel):
    """How many pixels of the view are of the color of outlines."""
    image = panel.browser.screenshot()[:, : panel.driver.find_element('id', 'view').rect['width']]
    return int(((image[..., 0] > 230) & (image[..., 2] < 90) & (abs(image[..., 1] - 200) < 40)).sum())


def test_a_number_under_the_mouse_has_what_it_moves_outlined(panel):
    hand = ActionChains(panel.driver)
    hand.move_to_element(panel.box('/lamp/unused')).perform()
    panel.browser.wait(lambda: not yellow(panel), 'no outline of what it does not move')
    hand.move_to_element(panel.box('/lamp/north')).perform()
    panel.browser.wait(lambda: yellow(panel) > 100, 'an outline')
    panel.browser.picture('source_hover')
    hand.move_to_element(panel.driver.find_element('id', 'tabs')).perform()
    panel.browser.wait(lambda: not yellow(panel), 'the outline is gone')


def test_what_is_selected_in_the_view_has_its_numbers_marked(panel, page, talker):
    panel.open('talker.py')
    panel.box('/talker/side')
    panel.driver.switch_to.frame('view')
    panel.browser.wait_for_text('lamp.py')
    panel.browser.see(PLACE)
    panel.browser.press(panel.browser.pixel(PLACE))
    panel.browser.release()
    panel.driver.switch_to.default_content()
    selected = lambda: panel.driver.find_elements('css selector', '#text input.selected')  # noqa: E731
    panel.browser.wait(lambda: len(selected()) == 2, 'both numbers of the lamp are marked')
    assert selected()[0].get_attribute('aria-label').startswith('/lamp/east')
    panel.browser.picture('source_selected')
    panel.driver.find_element('id', 'view').send_keys(Keys.ESCAPE)


def test_a_file_that_was_edited_has_the_numbers_that_are_still_there(panel, lamp):
    with open(lamp.file, encoding='utf-8') as file:
        before = file.read()
    edited = before.replace('rate = ', '# <b>two</b>\n# lines\nrate = ').replace('location(7.5,', 'location(8.5,')
    try:
        with open(lamp.file, 'w', encoding='utf-8') as file:
            file.write(edited)
        panel.says('not marked are unused: the file has changed since /lamp read it')
        assert '<b>two</b>' in panel.driver.find_element('id', 'text').text
        assert "location(-2.00, name='east'" in panel.line_of('/lamp/east')
        panel.type('/lamp/east', Keys.CONTROL, 'a', Keys.NULL, '-0.5', Keys.ENTER)
        has_become('/lamp/east', -0.5)
        with open(lamp.file, 'w', encoding='utf-8') as file:
            file.write('oops(\n' + before)
        panel.says('nothing is marked')
    finally:
        with open(lamp.file, 'w', encoding='utf-8') as file:
            file.write(before)
    panel.shows('/lamp/unused', '7.5')


def test_numbers_of_a_live_script_are_written_where_they_stand(panel, script):
    panel.open('way.script')
    names = [box.get_attribute('aria-label') for box in panel.browser.wait(lambda: panel.boxes(3), 'its numbers')]
    panel.browser.picture('source_script')
    panel.type(names[0].partition(',')[0], Keys.CONTROL, 'a', Keys.NULL, '1.5', Keys.ENTER)
    wait_until(lambda: script.read_text(encoding='utf-8').startswith('height = 1.5\n'), 'it is written', PATIENCE)
    panel.shows(names[0].partition(',')[0], '1.5')


def test_what_somebody_else_writes_takes_no_number_out_of_a_hand(panel, script):
    script.write_text('height = 1\ngoto(1, 0.5, height)\n', encoding='utf-8')
    panel.open('way.script')
    height, _, y = [
        box.get_attribute('aria-label').partition(',')[0] for box in panel.browser.wait(lambda: panel.boxes(3), 'it')
    ]
    panel.shows(y, '0.5')
    panel.type(y, Keys.CONTROL, 'a', Keys.NULL, '7')
    rosslt('set', height, '2')
    panel.shows(height, '2')
    panel.browser.wait(lambda: panel.line_of(height) == 'height = 2', 'the text is the new one')
    panel.shows(y, '7')
    ActionChains(panel.driver).send_keys('.5', Keys.ENTER, Keys.ARROW_UP).perform()
    panel.shows(y, '7.6')
    wait_until(lambda: script.read_text(encoding='utf-8') == 'height = 2\ngoto(1, 7.6, height)\n', 'it', PATIENCE)
    ActionChains(panel.driver).send_keys(Keys.ESCAPE).perform()
    panel.scrub(y, 80)
    wait_until(lambda: script.read_text(encoding='utf-8') == 'height = 2\ngoto(1, 9.6, height)\n', 'it', PATIENCE)
    panel.shows(y, '9.6')


#: Its file is not in UTF-8.
POLE = """# -*- coding: latin-1 -*-
import rospy
from geometry_msgs.msg import Point
rospy.init_node('pole')
pub = rospy.Publisher('pole', Point, queue_size=1)
while not rospy.is_shutdown():
    grün = 'ß'; height = 1e-1
    pub.publish(0.0, 0.0, height)
    rospy.sleep(0.05)
""".encode('latin-1').decode('utf-8', 'surrogateescape')


def test_numbers_of_an_unmodified_node_follow_edits_of_its_file(panel, tmp_path):
    with Unmodified(tmp_path, 'pole', POLE) as pole:
        panel.open('pole.py')
        panel.shows('/pole/height', '1e-1')
        assert panel.line_of('/pole/height').startswith("    grün = 'ß'; height = ")
        panel.type('/pole/height', Keys.ARROW_UP)
        panel.shows('/pole/height', '2e-1')
        panel.browser.wait(lambda: panel.box('/pole/height').get_attribute('aria-valuenow') == '0.2', 'it is in force')
        edited = POLE.replace('import rospy\n', 'import rospy\n\n\n').replace('1e-1', '3e-1')
        pole.file.write_text(edited, encoding='utf-8', errors='surrogateescape')
        panel.shows('/pole/height', '3e-1')
        panel.browser.wait(lambda: not panel.driver.find_elements('css selector', '.changed'), 'it is as in the file')


PAIR = """
    while not rospy.is_shutdown():
        both = [rosslt.location(2.0, name='arm', key=side) for side in ('left', 'right')]
        rospy.sleep(0.05)
    """


@pytest.mark.slow
def test_all_numbers_that_one_literal_says_stand_beside_each_other(panel):
    with Node('pair', PAIR):
        panel.open('pair.py')
        first, second = panel.browser.wait(lambda: panel.boxes(2), 'both')
        assert second.rect['x'] > first.rect['x']
        assert second.rect['y'] == first.rect['y']
        assert panel.line_of(first.get_attribute('aria-label').partition(',')[0]).count(', name=') == 1


BAD = [
    'x',
    '[]',
    '{}',
    '[' * 100000,
    '{"unlock": 1}',
    '{"open": "/etc/passwd"}',
    '{"open": ["/etc/passwd"]}',
    '{"open": null, "hover": null}',
    '{"hover": {}}',
    '{"diff": "/etc/passwd"}',
    '{"diff": {}}',
    '{"save": "/etc/passwd"}',
    '{"save": null}',
    '{"wish": 3}',
    '{"wish": {"number": "/lamp 1", "text": "3", "turn": 1}}',
    '{"wish": {"number": "/lamp 1", "text": 3, "turn": 1}}',
    '{"wish": {"number": ["/lamp"], "text": "3", "turn": 1}}',
    '{"wish": {"number": "NUMBER", "text": "3", "turn": 1}}',
]

ANSWERS = """
const [bad, done] = [arguments[0], arguments[arguments.length - 1]];
const socket = new WebSocket(`ws://${location.host}/source`);
const refused = [];
socket.onopen = () => {
    socket.send('{"hover": "/lamp 1"}'); // its node has ended: nothing is said of that
    bad.forEach(text => socket.send(text));
    socket.send(new Uint8Array([255, 0]));
};
socket.onclose = () => done('closed');
socket.onmessage = event => {
    const message = JSON.parse(event.data);
    if (message.refused) {
        refused.push(message.refused);
    }
    if (refused.length === bad.length + 1) {
        socket.onmessage = event => JSON.parse(event.data).document && done(refused);
        socket.send(JSON.stringify({open: document.querySelector('#tabs [aria-selected=true]').dataset.file}));
    }
};
"""


def test_bad_messages_are_refused_and_the_connection_lives_on(panel):
    panel.driver.set_script_timeout(PATIENCE)
    # no file is open there that this one stands in
    number = panel.box('/lamp/north').get_attribute('data-number')
    refused = panel.driver.execute_async_script(ANSWERS, [text.replace('NUMBER', number) for text in BAD])
    assert len(refused) == len(BAD) + 1, refused
    assert all(refused)
    assert refused[5] == 'no location stands in this file'
    assert refused[-2] == 'this number is not in the open file'
    assert value('/lamp/north') == 1.0


DECIDED = """
const [number, file, done] = arguments;
const ends = [0, 1].map(hand => new Promise(resolve => {
    const socket = new WebSocket(`ws://${location.host}/source`);
    socket.onopen = () => {
        socket.send(JSON.stringify({open: file}));
        for (let count = 0; count < 20; count += 1) {
            socket.send(JSON.stringify({wish: {number, text: `${hand}.${count}`, turn: 1}}));
        }
    };
    socket.onmessage = event => JSON.parse(event.data).decided?.text === `${hand}.19` && resolve(socket.close());
}));
Promise.all(ends).then(() => done());
"""


def test_each_of_two_people_at_one_number_hears_what_became_of_it(panel):
    panel.driver.set_script_timeout(PATIENCE)
    number = panel.box('/lamp/north').get_attribute('data-number')
    panel.driver.execute_async_script(DECIDED, number, panel.open_file())
    assert value('/lamp/north') in (0.19, 1.19)


KEEPER = """
import rospy
from geometry_msgs.msg import Point

class Keeper:
    def __init__(self):
        self.last = 0.5

rospy.init_node('keeper')
keeper = Keeper()
keeper.last = rospy.get_time()
pub = rospy.Publisher('keeper', Point, queue_size=1)
while not rospy.is_shutdown():
    pub.publish(0.0, 0.0, keeper.last)
    rospy.sleep(0.05)
"""


def test_what_a_node_cannot_take_or_say_is_said(panel, tmp_path):
    with Unmodified(tmp_path, 'keeper', KEEPER) as keeper:
        panel.open('keeper.py')
        panel.type('/keeper/last', Keys.CONTROL, 'a', Keys.NULL, '3', Keys.ENTER)
        panel.says('last is changed: it takes effect at the next start')
        keeper.process.send_signal(signal.SIGSTOP)
        keeper.file.write_text('# one line more\n' + KEEPER, encoding='utf-8')
        panel.says('/keeper does not answer')
        assert panel.boxes(0) == []
        keeper.process.send_signal(signal.SIGCONT)
        panel.browser.wait(lambda: 'line 8' in panel.box('/keeper/last').get_attribute('aria-label'), 'it is there')
        panel.type('/keeper/last', '7')
    panel.says('last is not marked any more: ')
    panel.says('No node runs that has numbers in keeper.py.')


@pytest.mark.slow
def test_in_a_narrow_window_the_source_is_below_the_view(panel):
    size = panel.driver.get_window_size()
    view, source = (panel.driver.find_element('id', name) for name in ('view', 'source'))
    try:
        panel.driver.set_window_size(780, 800)
        panel.browser.wait(lambda: source.rect['y'] > view.rect['y'] + 300, 'it is below')
        assert source.rect['width'] == view.rect['width']
        panel.browser.picture('source_narrow')
    finally:
        panel.driver.set_window_size(size['width'], size['height'])
    panel.browser.wait(lambda: source.rect['x'] > view.rect['x'] + 300, 'it is beside it')


@pytest.mark.slow
def test_the_source_is_made_wider_by_keys_and_mouse(panel):
    divider, source = (panel.driver.find_element('id', name) for name in ('divider', 'source'))
    width = source.rect['width']
    divider.send_keys(Keys.ARROW_LEFT)
    panel.browser.wait(lambda: source.rect['width'] > width, 'it is wider')
    ActionChains(panel.driver).drag_and_drop_by_offset(divider, 200, 0).perform()
    panel.browser.wait(lambda: source.rect['width'] < width - 100, 'it is narrower')


@pytest.mark.slow
@pytest.mark.parametrize('scheme', ['light', 'dark'])
def test_all_texts_can_be_read(panel, page, scheme):
    rosslt('set', '/lamp/north', '1.5')
    panel.prefer(scheme)
    panel.browser.open(page.url)
    panel.open('lamp.py')
    try:
        panel.shows('/lamp/north', '1.5')
        panel.type('/lamp/north', 'abc', Keys.ENTER)
        panel.says('is not a number')
        panel.browser.picture('source_' + scheme)
        assert panel.low_contrasts() == []
    finally:
        panel.prefer('')


@pytest.mark.slow
def test_the_panel_comes_back_with_its_page(panel):
    other = Server('__name:=again')
    try:
        panel.browser.open(other.url)
        panel.open('lamp.py')
        other.stop()
        other.start()
        panel.browser.wait(lambda: panel.driver.find_element('id', 'text').text, 'the text')
        rosslt('set', '/lamp/unused', '9.5')
        panel.shows('/lamp/unused', '9.5')
    finally:
        other.stop()
