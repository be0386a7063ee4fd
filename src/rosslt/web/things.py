"""The things of a scene in the page's 3D view, with the controls that a hand takes hold of.

Everybody who looks sees the same things. A thing that a hand holds is where this hand has it, for all of them.
"""

import asyncio
from typing import Any, Callable, Dict, List, Optional, Set, Tuple
from urllib.parse import quote

from rosslt.markers import HELD, Descriptions, Drags, Follower, Handle, Motions, Scene, mouse
from rosslt.markers.geometry import IDENTITY, PoseTuple, Rotation
from rosslt.web import drawing
from rosslt.web.frames import Frames

#: The length of arrows and the width of rings, relative to the thing that they surround.
CONTROL_SCALE = 1.5

#: The maximal number of things that all have arrows and rings; beyond it, only the thing clicked last has them. A
#: browser draws each arrow and ring separately, which takes most of the time.
MANY = 50

#: The rotation of a control that acts along, or around, the axes of the frame.
UPRIGHT: Rotation = IDENTITY


class Thing:
    """The drawing of one handle.

    Attributes:
        handle: the handle.
        motions: the ways in which it can be moved.
        body: viser's branch that its shapes stand on.
        arrows: viser's control to move it, or None.
        rings: viser's controls to turn it, in the order of its motions.
        shown: where it is drawn now.
    """

    def __init__(self, handle: Handle, motions: Motions, body: Any) -> None:
        self.handle, self.motions, self.body = handle, motions, body
        self.arrows: Optional[Any] = None
        self.rings: List[Any] = []
        self.shown = handle.pose
        self._placed: Dict[str, Tuple[mouse.Vector, Rotation]] = {}  # name of a part -> where it was put

    def put(self, pose: PoseTuple, held: Any = None) -> None:
        """Draw it at a pose.

        Args:
            held: the control that a hand holds, which is left alone.
        """
        self.shown = pose
        position = pose[0], pose[1], pose[2]
        self._place(self.body, position, _rotation(pose))
        if self.arrows is not None and self.arrows is not held:
            self._place(self.arrows, position, UPRIGHT)
        for control, ring in zip(self.rings, self.motions.rings):
            if control is not held:
                self._place(control, position, ring.orientation(_rotation(pose)))

    def forget(self, control: Any) -> None:
        """A hand has moved a control: it is not where it was put."""
        self._placed.pop(control.name, None)

    def remove(self) -> None:
        """Take it away."""
        for part in (self.arrows, *self.rings, self.body):
            if part is not None:
                part.remove()

    def _place(self, part: Any, position: mouse.Vector, rotation: Rotation) -> None:
        """Put a part somewhere; what stays as it is need not be sent to all browsers."""
        before = self._placed.get(part.name)
        self._placed[part.name] = position, rotation
        if before is None or before[0] != position:
            part.position = position
        if before is None or before[1] != rotation:
            x, y, z, w = rotation
            part.wxyz = (w, x, y, z)


class Grip:
    """A hand on the body of a thing: what it took hold of, and where the thing was then."""

    def __init__(self, grabbed: mouse.Vector, start: PoseTuple) -> None:
        self.grabbed, self.start = grabbed, start


class Things(Follower):
    """All things.

    Args:
        server: viser's.
        scene: what is shown.
        frames: where frames stand.
        descriptions: say which sources take changes.
        tell: called with (handle, text) where there is something to say of a thing to everybody, and with
            (handle, text, client) to say it to one of them.

    Attributes:
        free: the names of things whose bodies move in the plane of the screen.
        picked: called with (client, handle) when somebody clicks on a thing.
    """

    def __init__(
        self, server: Any, scene: Scene, frames: Frames, descriptions: Descriptions, tell: Callable[..., None]
    ) -> None:
        super().__init__(scene, descriptions)
        self._server, self._frames, self._tell = server, frames, tell
        self._drags: Optional[Drags] = None
        self._things: Dict[str, Thing] = {}
        self._grips: Dict[Tuple[str, int], Grip] = {}  # (name, client): of one thing, others try to take hold too
        self._holders: Dict[str, int] = {}  # name -> the client whose hand holds it
        self._is_crowded = False
        self._clicked = ''
        self.free: Set[str] = set()
        self.picked: Callable[[Any, Handle], None] = lambda client, handle: None

    def connect(self, drags: Drags) -> None:
        """Connect the drags, before the first thing is shown."""
        self._drags = drags

    def say(self, handle: Handle, text: str) -> None:
        """Show a message of a handle."""
        self._tell(handle, text)

    def draw(self, handle: Handle, motions: Motions) -> None:
        """Draw a thing, and the controls that its motions ask for."""
        self.erase(handle.name)
        scene = self._server.scene
        name = '{}/{}'.format(self._frames.branch(handle.frame), quote(handle.name, safe=':[]'))
        thing = Thing(handle, motions, scene.add_frame(name, show_axes=False))
        self._things[handle.name] = thing
        for index, shape in enumerate(handle.shapes()):
            for part in drawing.draw(scene, '{}/{}'.format(name, index), shape):
                self._make_grabbable(part, thing)
        if not self._is_crowded or handle.name == self._clicked:
            self._add_controls(thing, name)
        thing.put(handle.pose)

    def _add_controls(self, thing: Thing, name: str) -> None:
        scene, handle, motions = self._server.scene, thing.handle, thing.motions
        size = CONTROL_SCALE * handle.size
        if any(motions.arrows):
            thing.arrows = scene.add_transform_controls(
                name + '.move', size, active_axes=motions.arrows, disable_sliders=True, disable_rotations=True
            )
            self._on_control(thing.arrows, handle.name)
        for index in range(len(motions.rings)):
            ring = scene.add_transform_controls(
                '{}.turn{}'.format(name, index),
                size,
                active_axes=(False, True, True),  # viser draws an arc between two axes, around the third
                disable_axes=True,
                disable_sliders=True,
            )
            thing.rings.append(ring)
            self._on_control(ring, handle.name)

    def follow(self) -> bool:
        """Show what differs; returns whether anything did."""
        with self.lock:
            is_crowded = len(self._wanted) > MANY
            if is_crowded != self._is_crowded:
                self._is_crowded = is_crowded
                for name in list(self._things):
                    self.redraw(name)
            return super().follow()

    def move(self, handle: Handle) -> None:
        """Put a thing where it is now."""
        thing = self._things.get(handle.name)
        if thing is not None:
            thing.handle = handle
            thing.put(handle.pose)

    def erase(self, name: str) -> None:
        """Take a thing away."""
        thing = self._things.pop(name, None)
        if thing is not None:
            thing.remove()

    def shown(self, name: str) -> Optional[PoseTuple]:
        """The pose at which a thing is drawn, in its frame; None where there is none of that name."""
        thing = self._things.get(name)
        return thing.shown if thing is not None else None

    def keep_held(self) -> None:
        """Say that hands that rest still hold what they hold: a browser reports a mouse only as it moves."""
        if self._drags is not None:
            clients = self._server.get_clients()
            for name, client in list(self._holders.items()):
                if client in clients:
                    self._drags.keep(name, str(client))
                else:
                    self._holders.pop(name, None)

    def _on_control(self, control: Any, name: str) -> None:
        async def moved(event: Any) -> None:
            with self.lock:
                self._control_moved(event, control, name)

        control.on_update(moved)

    def _control_moved(self, event: Any, control: Any, name: str) -> None:
        """A hand has moved the arrows or a ring of a thing."""
        thing = self._things.get(name)
        if thing is None or self._drags is None or control not in (thing.arrows, *thing.rings):  # it was drawn anew
            self._ended(event, name)
            return
        thing.forget(control)
        pose: PoseTuple = thing.shown
        if control is thing.arrows:
            x, y, z = map(float, control.position)
            pose = (x, y, z, *thing.shown[3:])
        else:
            w, x, y, z = map(float, control.wxyz)
            start = self._grips.setdefault((name, event.client_id), Grip((0.0, 0.0, 0.0), thing.shown)).start
            rest = thing.motions.rings[thing.rings.index(control)].orientation(_rotation(start))
            pose = (*thing.shown[:3], *mouse.turned_by(rest, (x, y, z, w), start[3:]))
        if event.phase == 'start':
            self._grips[name, event.client_id] = Grip((0.0, 0.0, 0.0), thing.shown)
            pose = thing.shown
        self._hand(event, thing, pose, control)

    def _make_grabbable(self, part: Any, thing: Thing) -> None:
        handle, name = thing.handle, thing.handle.name

        async def grabbed(event: Any) -> None:
            with self.lock:
                self._body_moved(event, name)

        async def clicked(event: Any) -> None:
            with self.lock:
                thing = self._things.get(name)
                self._choose(name)
            if thing is not None:
                asyncio.get_running_loop().run_in_executor(None, self.picked, event.client, thing.handle)

        if handle.tracked:
            part.on_click(clicked)
        if any(thing.motions.axes):
            part.on_drag(grabbed)

    def _choose(self, name: str) -> None:
        """A thing has been clicked: of many, it alone has arrows and rings."""
        before, self._clicked = self._clicked, name
        if self._is_crowded and before != name:
            for one in (before, name):
                self.redraw(one)

    def _body_moved(self, event: Any, name: str) -> None:
        """A hand has moved the body of a thing."""
        thing = self._things.get(name)
        if thing is None or self._drags is None:
            self._ended(event, name)
            return
        frame = self._frames.pose(thing.handle.frame)
        if event.phase == 'start':
            self._grips[name, event.client_id] = Grip(mouse.into(frame, event.start_position), thing.shown)
        grip = self._grips.get((name, event.client_id))
        if grip is None:
            return
        motions = thing.motions
        turned = UPRIGHT if motions.is_in_frame else _rotation(grip.start)
        eye = mouse.into(frame, event.client.camera.position)
        pointer = mouse.into(frame, event.end_position)
        way = mouse.dragged(grip.grabbed, eye, pointer, motions.of_body(name in self.free), turned)
        pose = thing.shown
        if way is not None:
            x, y, z = (a + b for a, b in zip(grip.start, way))
            pose = (x, y, z, *grip.start[3:])
        self._hand(event, thing, pose)

    def _hand(self, event: Any, thing: Thing, pose: PoseTuple, control: Any = None) -> None:
        """Hand on to the drags what a hand does; the first hand on a thing holds it."""
        drags, handle, hand = self._drags, thing.handle, str(event.client_id)
        if drags is None:
            return
        name = handle.name
        if event.phase == 'start':
            if not drags.hold(name, hand, handle.frame, thing.shown):
                self._tell(handle, HELD, event.client)
                thing.put(thing.shown)
            else:
                self._holders[name] = event.client_id
            return
        if event.phase == 'end':
            self._ended(event, name)
            if not drags.release(name, handle.frame, pose, hand):
                thing.put(thing.shown)  # the browser has moved it all the same
            return
        # a hand that was refused does not get the thing in the middle of its way, where it would jump to the hand
        if self._holders.get(name) == event.client_id and drags.move(name, handle.frame, pose, hand):
            thing.put(pose, control)
        else:
            self._tell(handle, HELD, event.client)
            thing.put(thing.shown)

    def _ended(self, event: Any, name: str) -> None:
        """A hand that lets go holds nothing any more, not even of what is gone meanwhile."""
        if event.phase == 'end':
            self._grips.pop((name, event.client_id), None)
            if self._holders.get(name) == event.client_id:
                del self._holders[name]


def _rotation(pose: PoseTuple) -> Rotation:
    return pose[3], pose[4], pose[5], pose[6]
