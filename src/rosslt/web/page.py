"""The page: viser's server, and all that stands on it, kept up to date."""

import traceback
from typing import Any, Optional

import rospy
import viser

from rosslt import node
from rosslt.markers import Descriptions, Drags, Handle, HeldTopic, Offers, Rules, Scene, Settings, Watch, short_numbers
from rosslt.web.access import AccessCheck, NotServed, check_address, guarded, is_this_machine, read_password
from rosslt.web.buttons import Buttons
from rosslt.web.details import Details
from rosslt.web.fields import Fields
from rosslt.web.flows import Flows
from rosslt.web.frames import Frames
from rosslt.web.locations import Locations
from rosslt.web.notices import Notices
from rosslt.web.numbers import Numbers
from rosslt.web.refresh_timer import RefreshTimer
from rosslt.web.things import Things

NODE = 'slt_web'

#: The rate at which things follow messages, and fields follow their owners' changes, in Hz.
FRAME_RATE = 30.0

#: The number of frames between two updates of the list of fields and of the plots.
FIELDS_EVERY = 3

#: The light from all sides: how strong it is, in viser's unit, and the color of what comes from below.
SKY_LIGHT, GROUND_COLOR = 1.5, (150, 150, 150)


class Server(viser.ViserServer):
    """viser's server, which nobody can have published on the Internet."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Do not: any browser could ask for it."""


class Page:
    """The web page, shared by all its visitors.

    Args:
        host: the address to listen at.
        port: the port.
        password: what has to be given to see it, or None.
        fixed_frame: the frame that stands still; by default the one that most others hang on.

    Raises:
        NotServed: it cannot listen there.
    """

    def __init__(self, host: str, port: int, password: Optional[str] = None, fixed_frame: str = '') -> None:
        check_address(host, port)
        with guarded(AccessCheck(host, password)):
            self._server = Server(host=host, port=port, label='rosslt', verbose=False)
        if self._server.get_port() != port:  # viser takes the next one
            self._server.stop()
            raise NotServed('cannot listen at {} port {}: somebody else does'.format(host, port))
        self._server.gui.configure_theme(show_logo=False, show_share_button=False, control_width='large')
        _furnish(self._server.scene)
        self._server.initial_camera.position = (-3.0, -4.5, 3.5)
        self._server.initial_camera.look_at = (0.0, 0.0, 0.5)
        self._notices = Notices()
        self._timer = RefreshTimer(FRAME_RATE)
        scene = Scene(Settings(draws_all=True))
        descriptions = Descriptions()
        drags = Drags(scene, Rules(), descriptions.name, rospy.get_name(), node.NodeErrors())
        self._scene = scene
        self._frames = Frames(self._server, fixed_frame)
        self._things = Things(self._server, scene, self._frames, descriptions, self._say)
        self._things.connect(drags)
        scene.on_news = self._timer.request
        drags.share(HeldTopic(drags.hear).tell)
        flows = Flows(self._server)
        self._details = Details(Offers(scene, drags, descriptions), self._things, flows)
        self._things.picked = self._details.show
        self._locations = Locations(self._timer.request)
        everything = self._server.gui.add_button('Data flow')
        everything.on_click(lambda event: flows.open(event.client, 'Data flow', lambda: None))
        self._fields = Fields(self._server, flows, descriptions)
        buttons = Buttons(self._server, self._locations, flows, self._notices.tell)
        self._numbers = Numbers(self._server, self._locations, buttons.add, self._notices.tell)
        Watch(scene)

    def show(self) -> None:
        """Keep the page up to date until this node is shut down."""
        count = 0
        while not rospy.is_shutdown():
            try:
                self._update(count)
            except Exception:  # what is odd for a moment must not end the page
                rospy.logerr_throttle(10, 'while bringing the page up to date:\n%s', traceback.format_exc())
            count += 1
            self._timer.wait()
        self._server.stop()

    def _update(self, count: int) -> None:
        self._scene.expire()
        self._things.keep_held()
        with self._server.atomic():  # what has moved together is sent, and shown, together
            self._frames.update()
            self._things.follow()
            self._numbers.follow()
        self._server.flush()  # viser would wait for more
        if count % FIELDS_EVERY == 0:
            self._numbers.update()
            clients = self._server.get_clients()
            self._details.update(clients)
            self._fields.update(clients)

    def _say(self, handle: Handle, text: str, to: Any = None) -> None:
        """Show a message of a thing to somebody; None for everybody who looks."""
        for client in self._server.get_clients().values() if to is None else [to]:
            self._notices.tell(client, handle.name, short_numbers(text))


def _furnish(scene: Any) -> None:
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
        host, port, fixed_frame: as of a Page.
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
