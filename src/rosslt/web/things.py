"""The things of a scene in the page's 3D view, with the controls that a hand takes hold of.

Everybody who looks sees the same things. A thing that a hand holds is where this hand has it, for all of them.
"""

import asyncio
from typing import Any, Callable, ContextManager, Dict, List, Optional, Set, Union
from urllib.parse import quote

import viser

from rosslt import values
from rosslt.markers import HELD, Follower, Handle, Motions, Offers, mouse
from rosslt.markers.geometry import IDENTITY, PoseTuple, Rotation
from rosslt.web import drawing
from rosslt.web.clicks import Clicks
from rosslt.web.frames import Frames

#: What a browser reports of a hand.
Event = Union[viser.TransformControlsEvent, viser.SceneNodeDragEvent]

#: The length of an arrow, and the width of the lines of arrows and rings, in pixels, at any distance.
ARROW_LENGTH, LINE_WIDTH = 90.0, 3.0

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
        hand: the client that holds it, or None.
        start: where it was when this hand took hold of it.
        grabbed: the point of the body that it took hold of.
        outline: the frame around it, if it is marked.
    """

    def __init__(self, handle: Handle, motions: Motions, body: viser.FrameHandle) -> None:
        self.handle, self.motions, self.body = handle, motions, body
        self.arrows: Optional[viser.TransformControlsHandle] = None
        self.rings: List[viser.TransformControlsHandle] = []
        self.shown = self.start = handle.pose
        self.hand: Optional[int] = None
        self.grabbed: mouse.Vector = (0.0, 0.0, 0.0)
        self.outline: Optional[viser.SceneNodeHandle] = None

    def put(self, pose: PoseTuple, held: Optional[viser.TransformControlsHandle] = None) -> None:
        """Draw it at a pose.

        Args:
            held: the control that a hand holds, which is left alone.
        """
        self.shown = pose
        upright = [] if self.arrows is None else [(self.arrows, UPRIGHT)]
        rings = [(ring, one.orientation(_rotation(pose))) for ring, one in zip(self.rings, self.motions.rings)]
        for part, (x, y, z, w) in [(self.body, _rotation(pose)), *upright, *rings]:
            if part is not held:
                part.position, part.wxyz = pose[:3], (w, x, y, z)

    def remove(self) -> None:
        """Take it away."""
        for part in (*self.controls(), self.body):
            part.remove()

    def controls(self) -> List[viser.TransformControlsHandle]:
        """viser's controls that are there."""
        return self.rings if self.arrows is None else [self.arrows, *self.rings]


class Things(Follower):
    """All things.

    Args:
        server: viser's.
        lock: of the page.
        offers: what is shown, and what hands can do.
        frames: where frames stand.
        clicks: what visitors have selected.
        tell: called with (handle, text) if there is something to say of a thing to everybody, and with
            (handle, text, client) to say it to one of them.

    Attributes:
        lock: of the page.
        marked: the sources of which all things have an outline that come from them.
        picked: called with (client, handle) when somebody clicks on a thing that shows its handles.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        lock: ContextManager[bool],
        offers: Offers,
        frames: Frames,
        clicks: Clicks,
        tell: Callable[..., None],
    ) -> None:
        super().__init__(offers.scene, offers.descriptions, clicks.selection)
        self.lock = lock
        self._server, self._frames, self._tell, self._drags = server, frames, tell, offers.drags
        self._clicks = clicks
        self._things: Dict[str, Thing] = {}
        self.marked: Set[values.Source] = set()
        self.picked: Callable[[viser.ClientHandle, Handle], None] = lambda client, handle: None

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
        self._add_controls(thing)
        thing.put(handle.pose)

    def follow(self) -> bool:
        """Show what differs; returns whether anything did."""
        self._clicks.update()
        has_changed = super().follow()
        for thing in self._things.values():
            self._mark(thing)
        return has_changed

    def selected_sources(self) -> List[values.Source]:
        """The sources of the things that are selected, first those that are their own."""
        selected = [
            thing.handle.tracked for thing in self._things.values() if thing.handle.thing in self.selection.things
        ]
        return self._descriptions.own_first(values.sources(selected))

    def _mark(self, thing: Thing) -> None:
        """Draw the outline of a thing, or take it away."""
        is_marked = bool(self.marked) and not self.marked.isdisjoint(values.sources(thing.handle.tracked))
        shapes = list(thing.handle.shapes()) if is_marked and thing.outline is None else []
        if shapes:
            thing.outline = drawing.outline(self._server.scene, thing.body.name + '/outline', shapes)
        elif not is_marked and thing.outline is not None:
            thing.outline.remove()
            thing.outline = None

    def _add_controls(self, thing: Thing) -> None:
        motions, name = thing.motions, thing.body.name
        if any(motions.arrows):
            thing.arrows = self._control(name + '.move', active_axes=motions.arrows, disable_rotations=True)
        for index in range(len(motions.rings)):
            # viser draws an arc between two axes, around the third
            ring = self._control(f'{name}.turn{index}', active_axes=(False, True, True), disable_axes=True)
            thing.rings.append(ring)
        for control in thing.controls():
            self._on_control(control, thing.handle.name)

    def _control(self, name: str, **options: object) -> viser.TransformControlsHandle:
        return self._server.scene.add_transform_controls(
            name, ARROW_LENGTH, fixed=True, line_width=LINE_WIDTH, depth_test=False, disable_sliders=True, **options
        )

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

    def keep_held(self) -> None:
        """Keep the holds of resting hands: a browser reports a mouse only while it moves."""
        clients = self._server.get_clients()
        for name, thing in self._things.items():
            if thing.hand in clients:
                self._drags.keep(name, str(thing.hand))

    def _on_control(self, control: viser.TransformControlsHandle, name: str) -> None:
        async def moved(event: viser.TransformControlsEvent) -> None:
            with self.lock:
                self._control_moved(event, control, name)

        control.on_update(moved)

    def _control_moved(
        self, event: viser.TransformControlsEvent, control: viser.TransformControlsHandle, name: str
    ) -> None:
        """A hand has moved the arrows or a ring of a thing."""
        thing = self._things.get(name)
        if thing is None or control not in thing.controls():  # it was drawn anew
            return
        if not self._has(event, thing) or event.phase == 'start':
            return
        if control is thing.arrows:
            x, y, z = map(float, control.position)
            self._move(event, thing, (x, y, z, *thing.start[3:]), control)
        else:
            w, x, y, z = map(float, control.wxyz)
            rest = thing.motions.rings[thing.rings.index(control)].orientation(_rotation(thing.start))
            turned = mouse.turned_by(rest, (x, y, z, w), thing.start[3:])
            self._move(event, thing, (*thing.start[:3], *turned), control)

    def _make_grabbable(self, part: Any, thing: Thing) -> None:
        handle, name = thing.handle, thing.handle.name

        async def grabbed(event: viser.SceneNodeDragEvent) -> None:
            with self.lock:
                self._body_moved(event, name)

        async def clicked(event: viser.SceneClickEvent) -> None:
            with self.lock:
                is_open = self.selection.is_open(handle)
                self._clicks.click(event.client, handle.thing)
            if is_open:
                asyncio.get_running_loop().run_in_executor(None, self.picked, event.client, thing.handle)

        if handle.tracked or thing.motions.is_button:
            part.on_click(clicked)
        if any(thing.motions.axes):
            part.on_drag(grabbed)

    def _body_moved(self, event: viser.SceneNodeDragEvent, name: str) -> None:
        """A hand has moved the body of a thing."""
        thing = self._things.get(name)
        if thing is None or not self._has(event, thing):
            return
        frame, motions = self._frames.pose(thing.handle.frame), thing.motions
        if event.phase == 'start':
            thing.grabbed = mouse.into(frame, event.start_position)
            return
        turned = UPRIGHT if motions.is_in_frame else _rotation(thing.start)
        eye = mouse.into(frame, event.client.camera.position)
        pointer = mouse.into(frame, event.end_position)
        way = mouse.dragged(thing.grabbed, eye, pointer, motions.of_body(name in self.free), turned)
        pose = thing.shown
        if way is not None:
            x, y, z = (a + b for a, b in zip(thing.start, way))
            pose = (x, y, z, *thing.start[3:])
        self._move(event, thing, pose)

    def _has(self, event: Event, thing: Thing) -> bool:
        """Return whether a hand has a thing: it takes hold with its first event, or is told that it does not."""
        hold = self._drags.hold
        if event.phase == 'start' and hold(thing.handle.name, str(event.client_id), thing.handle.frame, thing.shown):
            thing.hand, thing.start = event.client_id, thing.shown
            self._clicks.select(event.client, thing.handle.thing)
        if thing.hand != event.client_id:
            self._refuse(event, thing)
        return thing.hand == event.client_id

    def _move(
        self, event: Event, thing: Thing, pose: PoseTuple, control: Optional[viser.TransformControlsHandle] = None
    ) -> None:
        """The hand that holds a thing has moved it, or lets it go there."""
        name, frame, hand = thing.handle.name, thing.handle.frame, str(event.client_id)
        if event.phase == 'end':
            thing.hand = None
            if not self._drags.release(name, frame, pose, hand):
                thing.put(thing.shown)  # the browser has moved it all the same
        elif self._drags.move(name, frame, pose, hand):
            thing.put(pose, control)
        else:
            self._refuse(event, thing)

    def _refuse(self, event: Event, thing: Thing) -> None:
        """Tell a hand that a second hand holds the thing, and put the thing back."""
        if event.phase != 'end':
            self._tell(thing.handle, HELD, event.client)
        thing.put(thing.shown)


def _rotation(pose: PoseTuple) -> Rotation:
    return pose[3], pose[4], pose[5], pose[6]
