"""The page: viser's server, and all that stands on it, kept up to date."""

import threading
from typing import Optional

import rospy
import viser

from rosslt import node
from rosslt.markers import (
    FRAME_RATE,
    Descriptions,
    Drags,
    Handle,
    Offers,
    OtherViews,
    Rules,
    Scene,
    Settings,
    Watch,
    contained,
    short_numbers,
)
from rosslt.web.access import AccessCheck, NotServed, check_address, guarded, is_this_machine, read_password
from rosslt.web.buttons import Buttons
from rosslt.web.clicks import Clicks
from rosslt.web.details import Details
from rosslt.web.flows import Flows
from rosslt.web.frames import Frames
from rosslt.web.location_inputs import Numbers
from rosslt.web.locations import Locations
from rosslt.web.notices import Notices
from rosslt.web.plots import Plots
from rosslt.web.source_panel import SourcePanel
from rosslt.web.things import Things

NODE = 'slt_web'

#: The number of frames between two updates of the fields and plots.
EVERY = 6

#: The light from all sides: how strong it is, in viser's unit, and the color of what comes from below.
SKY_LIGHT, GROUND_COLOR = 2.2, (200, 200, 200)


class Server(viser.ViserServer):
    """viser's server, which nobody can have published on the Internet."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Do not: any browser could ask for it."""


class Page:
    """The web page, shared by all its visitors.

    viser calls in its own threads what a visitor does, and the nodes' messages come in others: whatever changes the
    page, or reads what it shows, holds its one lock, and asks no node meanwhile.

    Args:
        host: the address to listen at.
        port: the port.
        password: what has to be given to see it, or None.
        fixed_frame: the frame that stands still; by default the one that most others hang on.

    Raises:
        NotServed: it cannot listen there.
    """

    def __init__(self, host: str, port: int, password: Optional[str] = None, fixed_frame: str = '') -> None:
        self._lock = lock = threading.RLock()
        self._locations = Locations(lock)
        self._source = SourcePanel(lock, self._locations)
        with guarded(AccessCheck(host, password), self._source):
            self._server = server = Server(host=host, port=port, label='rosslt', verbose=False)
        if server.get_port() != port:  # viser takes the next one
            server.stop()
            raise NotServed('cannot listen at {} port {}: somebody else does'.format(host, port))
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width='large')
        _furnish(server.scene)
        server.initial_camera.position = (-3.0, -4.5, 3.5)
        server.initial_camera.look_at = (0.0, 0.0, 0.5)
        self._scene = scene = Scene(Settings(draws_all=True))
        descriptions = Descriptions()
        others = OtherViews(scene, lambda hand: 'the page')
        drags = Drags(scene, Rules(), descriptions.name, node.NodeErrors().raised_since, others)
        offers = Offers(scene, drags, descriptions)
        self._frames = Frames(server, lock, fixed_frame)
        self._notices, flows = Notices(server, lock), Flows(server, lock)
        everything = server.gui.add_button('Data flow')
        everything.on_click(lambda event: flows.open(event.client, 'Data flow', lambda: None))
        self._plots = Plots(server, flows, descriptions)
        self._things = Things(server, lock, offers, self._frames, Clicks(server, lock), self._say)
        self._things.picked = Details(offers, self._things, flows, self._plots).show
        buttons = Buttons(server, self._locations, flows, self._notices.tell)
        self._numbers = Numbers(server, lock, self._locations, buttons.add, self._notices.tell)
        looks = (lambda _: self._frames.find_root(), flows.update, self._locations.update, self._source.look)
        Watch(scene, also=looks)

    def show(self) -> None:
        """Keep the page up to date until this node is shut down."""
        count = 0
        while not rospy.is_shutdown():
            with contained('the page cannot be brought up to date'), self._lock:
                self._update(count)
            count += 1
            rospy.rostime.wallsleep(1.0 / FRAME_RATE)
        self._server.stop()

    def _update(self, count: int) -> None:
        self._scene.expire()
        self._things.keep_held()
        self._things.marked = self._source.hovered()
        with self._server.atomic():  # things that moved together are sent, and shown, together
            self._frames.update()
            self._things.follow()
        self._server.flush()  # viser would wait for more
        if count % EVERY == 0:
            self._numbers.update()
            self._source.selected = self._things.selected_sources()
            self._plots.update()

    def _say(self, handle: Handle, text: str, to: Optional[viser.ClientHandle] = None) -> None:
        """Show a message of a thing to somebody; None for everybody who looks."""
        for client in self._server.get_clients().values() if to is None else [to]:
            self._notices.tell(client, handle.name, short_numbers(text))


def _furnish(scene: viser.SceneApi) -> None:
    """Light and ground, without shadows and reflections.

    A browser that draws with the processor takes most of a frame for these, however little there is to see: they cost
    time for each pixel. One soft light from above and below stands for the reflections.
    """
    scene.set_up_direction('+z')
    scene.configure_default_lights(cast_shadow=False)
    scene.configure_environment_map(hdri=None)
    scene.add_light_hemisphere('/sky', ground_color=GROUND_COLOR, intensity=SKY_LIGHT)
    scene.add_grid('/grid', 10.0, 10.0, plane='xy', cell_size=1.0, section_size=10.0, shadow_opacity=0.0)


def run(
    host: str, port: int, password_file: Optional[str] = None, needs_no_password: bool = False, fixed_frame: str = ''
) -> None:
    """Show the page until this node is shut down.

    Args:
        host, port, fixed_frame: as in a Page.
        password_file: a file whose first line is the password; None for no password.
        needs_no_password: whether a page that others can reach may go without.

    Raises:
        NotServed: it cannot be served like that.
    """
    if password_file is None and not is_this_machine(host) and not needs_no_password:
        raise NotServed(
            'others can reach {}, and change what the robot does: give a --password-file, or --no-password where '
            'everybody may'.format(host)
        )
    password = None if password_file is None else read_password(password_file)
    check_address(host, port)
    node.init_node(NODE)
    page = Page(host, port, password, fixed_frame)
    rospy.loginfo('the page is at http://%s:%d', host, port)
    page.show()
