"""This node as the owner of its locations: what it reports about them, and the changes that it accepts.

The paper's `apply_source_change` and the service for reevaluation (section IV-A, figure 3). Below `<node>/rosslt`: the
services `change_sources`, `get_values`, `list_locations`, `list_edits` and `get_history`, the topics `changes` and
`locations`, and the parameters `accept_changes_from`, `change_locks`, `history` and `rate`. For all nodes: the topic
`/rosslt/source_change`.
"""

import threading
import time
from typing import Callable, Dict, Iterable, List, Optional, Sequence, Tuple, Type

import rospy

from rosslt import msg, srv, values
from rosslt.messages import Scalar
from rosslt.node import reconfigure
from rosslt.node.callbacks import Callbacks
from rosslt.node.change import locks
from rosslt.node.change.commit_participant import ABORTED, APPLIED, UNKNOWN, CommitParticipant
from rosslt.node.change.fault_localization import described_error, locations_read, with_effects
from rosslt.node.change.history import EDITOR, History, Request, applied_change, differing
from rosslt.node.change.lock_service import Locking
from rosslt.node.change.locks import Access
from rosslt.node.change.node_errors import CALLBACK_RAISES, ENDS, THREAD_ENDS, TIMER_RAISES
from rosslt.node.change.subscriber_calls import AWAITED, SubscriberCalls
from rosslt.node.json_scalars import Refused, to_json
from rosslt.node.locations.directory import Directory
from rosslt.node.locations.location import (
    Change,
    HeldLocation,
    LiteralLocation,
    Location,
    Locations,
    ParameterLocation,
    put_in_force,
)
from rosslt.node.locations.report import all_described, described, edits_described
from rosslt.node.locations.source_files import SOURCE_FILES
from rosslt.node.master_watch import MASTER_WATCH
from rosslt.node.memory.outdated import outdated
from rosslt.node.memory.remembered import MEMORY
from rosslt.node.memory.rounds import watch_round
from rosslt.node.parameters.mirror import Parameters
from rosslt.node.parameters.sources import ReadParameters
from rosslt.node.topics.serialization import Sending

#: The maximal wait of an acknowledgement for the parameter server, in seconds; the change is in force in any case.
FOLLOW_TIMEOUT = 1.0

#: Parameters in the namespace of the locations that are settings of the node.
SETTINGS = Sending.NAMES | locks.SETTINGS

#: Many locations are created together: they are published so long after the first one, in seconds.
SETTLING = 0.2

#: Changes of the last seconds are taken back if the main program, a thread or a callback raises an exception.
SUSPECT = 5.0

#: The maximal number of changes that wait to be sent on `<node>/rosslt/changes`.
CHANGES_QUEUE = 1000


class Owner:
    """The locations of this process: held from the start, served in the ROS graph once it is a node.

    Attributes:
        name: the full name of the node, '' until `serve`.
        locations: its Locations.
        parameters: the parameters behind them.
        read_parameters: those that this node reads as sources.
        look_at_files: called before edits are listed: takes in what the source files say now, and returns what else
            is another there; None if the node does not follow them.
        make_all_known: called before all locations are listed: makes those known that are not yet.
        settings: the names of parameters in the namespace of the locations that are settings of the node.
        directory: what is known of sources, its own and others'.
        lock: that of the locations.
        access: who may change what.
        locking: the service that locks locations.
        main_ends: whether the main program has raised an exception, and this node still sees to its changes.
    """

    def __init__(self) -> None:
        self.name = ''
        self.locations = Locations()
        self.lock = self.locations.lock
        self.access = Access()
        self.settings = SETTINGS
        self.parameters = Parameters(
            self, lambda: self.read_parameters.write(), lambda key: self.read_parameters.learn(key)
        )
        self.read_parameters = ReadParameters(self, self.parameters)
        self.directory = Directory(self._described, lambda: self.name)
        self.main_ends = False
        self._asked = threading.Condition()
        self.history = History()
        self.look_at_files: Callable[[], Optional[List[str]]] = lambda: None
        self.make_all_known: Callable[[], None] = lambda: None
        self._on_change = Callbacks('rosslt on_change')
        self._background = Callbacks('rosslt background')
        self._calls = SubscriberCalls(lambda error, before: self.take_back_what_ends_it(error, CALLBACK_RAISES, before))
        self._locations: Optional[rospy.Publisher] = None
        self._participant = CommitParticipant(self, self._background)
        self.change_sources = self._participant.change_sources
        self.locking = Locking(self, self.parameters, self._participant.wait_for)
        self._show_to_reconfigure: Callable[[], None] = lambda: None
        values.describe_sources_with(self.directory.describe)
        Sending.hold = self._hold

    def serve(self) -> None:
        """Make this node's locations known and changeable; rospy has been told the node's name before."""
        with self.lock:
            self.parameters.start(rospy.get_name())
            self.read_parameters.follow()
            self.access.start(rospy.get_name())
            for setting in SETTINGS:
                if self.parameters.setting(setting) is not None:
                    self.set_setting(setting, self.parameters.setting(setting))
            self._changes = rospy.Publisher('~rosslt/changes', msg.AppliedChange, queue_size=CHANGES_QUEUE)
            self.name = rospy.get_name()
            self.locations.name_node(self.name)
            literals = [one for one in self.locations.by_id.values() if isinstance(one, LiteralLocation)]
            self.parameters.take_over(literals)
            self.history.begin(self.parameters.last_request)
            for location in literals:
                self.parameters.follow(location, is_written=True)
            self._locations = rospy.Publisher('~rosslt/locations', msg.LocationList, queue_size=1, latch=True)
            self.locations.on_locations_changed(self.publish_locations)
            MEMORY.begins.append(self._begin_rounds)
        self._show_to_reconfigure = reconfigure.serve(self, self._background)
        self.publish_locations()
        rospy.Service('~rosslt/get_values', srv.GetValues, self.get_values)
        rospy.Service('~rosslt/list_locations', srv.ListLocations, self._list_locations)
        rospy.Service('~rosslt/list_edits', srv.ListEdits, self._list_edits)
        rospy.Service('~rosslt/get_history', srv.GetHistory, self._get_history)
        rospy.Service('~rosslt/change_sources', srv.ChangeSources, self.change_sources)
        rospy.Subscriber('/rosslt/source_change', msg.SourceChange, self._source_change)
        self.locking.serve()
        self._calls.watch()
        MASTER_WATCH.renewals.append(self._renew)
        MASTER_WATCH.start()

    def publish_locations(self) -> None:
        """Publish the locations soon: the list has changed, or who may change them."""
        if self._locations is not None:
            self._background.call_soon(self._publish_locations, SETTLING)
            self._show_to_reconfigure()

    def _publish_locations(self) -> None:
        listed = self._list_locations(srv.ListLocationsRequest()).locations
        if self._locations is not None and not rospy.is_shutdown():
            self._locations.publish(self.name, listed)

    def _begin_rounds(self) -> None:
        self.locations.begin_rounds()
        with self.lock:
            self.parameters.tell_lost(self.locations.by_id.values())
        self.publish_locations()

    def _renew(self) -> None:
        """The master was restarted, and knows no parameters of this node."""
        self.parameters.renew()
        self.read_parameters.follow(is_new_master=True)

    def add_literal(self, location: LiteralLocation, is_written: bool = True) -> Location:
        """Take in the location of a literal, with a parameter behind it.

        Args:
            location: of a call of `location()`, or of a literal that the node may have read.
            is_written: whether it is of such a call: then its parameter shows it at once.

        Returns:
            the location that is in force.
        """
        with self.lock:
            SOURCE_FILES.keep(location.site.file)
            if self.name and not self.locations.is_taken(location.name):
                location.name_node(self.name)  # the memory of the node is searched by the names of sources
                if is_written:  # nothing has read the new location
                    self.parameters.take_over_unread(location)
                else:
                    self.parameters.take_over([location])
            in_force = self.locations.add(location)
            if in_force is location and self.name:
                self.parameters.follow(location, is_written)
        return in_force

    def wait_for_parameters(self, written: int) -> None:
        """Wait until parameters have followed, as `follow` has returned it."""
        if not self.parameters.wait(written, FOLLOW_TIMEOUT):
            rospy.logwarn('the change is in force, but its parameter could not be set yet')

    def get_values(self, request: srv.GetValuesRequest) -> srv.GetValuesResponse:
        """The current values of several locations; serves `~rosslt/get_values`."""
        return srv.GetValuesResponse(*self._present(request.location_ids))

    def _present(self, ids: Sequence[int]) -> Tuple[List[str], List[str]]:
        """(The present values of locations, why there is none), one of both empty for each."""
        texts, reasons = [], []
        for location_id in ids:
            text = reason = ''
            try:
                text = to_json(self.known(location_id).value)
            except Refused as refused:
                reason = str(refused)
            texts.append(text)
            reasons.append(reason)
        return texts, reasons

    def to_undo(self, request_id: str, requester: str) -> Tuple[List[Request], List[Tuple[Location, Scalar]]]:
        """Find what takes a request back: the requests of that id, and [(location, value that it gets again)].

        Raises:
            Refused: no change is taken now, or the location was changed since.
        """
        self._claim_changes()
        requests, back = self.history.to_undo(request_id, self.locations.by_id)
        return requests, [(self.changeable(location, requester), old) for location, old in back.items()]

    def _claim_changes(self, kind: Type[HeldLocation] = HeldLocation) -> None:
        """Tell the history which locations that an earlier run has changed exist now."""
        for location in [one for one in self.locations.by_id.values() if isinstance(one, kind)]:
            self.history.claim(location, location.value)

    def _kept_from_before(self) -> Dict[Location, Tuple[Scalar, Scalar]]:
        """{Location: (value in the code, value)} of the literals that still have the value of their parameter that they
        were started with."""
        return {
            one: (one.literal, one.value)
            for one in self.locations.by_id.values()
            if isinstance(one, LiteralLocation) and one.remembered
        }

    def applied(self, changes: Sequence[Change], requester: str, request_id: str = '', record: bool = True) -> None:
        """Publish changes that have been applied, and add them to the history."""
        changes = differing(changes)
        stamp = rospy.Time.now()
        for location, old, new in changes:
            location.remembered = False
            location.turn += 1
            self._changes.publish(applied_change(stamp, location, old, new, requester))
        # Those of a message's leaves are one function, which is called once.
        for function in dict.fromkeys(function for location, _, _ in changes for function in location.changed):
            self._on_change.call_soon(function)
        if changes:
            self._show_to_reconfigure()
        if record and changes:
            self.history.record(request_id, requester, stamp, changes)

    def known(self, location_id: int) -> Location:
        location = self.locations.by_id.get(location_id)
        if location is None:
            raise Refused(f'{self.name} has no location {location_id}')
        return location

    def take_back_what_ends_it(self, error: BaseException, what_ends: str, went_well: float = 0.0) -> bool:
        """Take back the changes of the last moments, if an exception ends the main program or a thread of it, or
        makes a callback useless: their values would be remembered, and do so at each start.

        Args:
            error: the exception.
            what_ends: how the report begins, one of the texts in `node_errors`.
            went_well: a time of `time.monotonic`; if there are changes since then, those before are left, and if there
                are none, those that do not reach the line of the exception.

        Returns:
            Whether there were any, and all are taken back.
        """
        if rospy.is_shutdown():
            return False
        if what_ends == TIMER_RAISES:
            went_well = self._calls.last_in(threading.current_thread())
        states = []
        with self.lock:
            self._claim_changes(ParameterLocation)
            kept = self._kept_from_before()
            suspects = self.history.since(time.monotonic() - SUSPECT)
            read = locations_read(error, {**self.history.in_force(), **kept})
            suspects = [one for one in suspects if one.at > went_well] or suspects
            if what_ends not in (ENDS, THREAD_ENDS):  # it is called again: if it still raises, the others go as well
                suspects = [one for one in suspects if read.intersection(one.changes)] or suspects
            earlier = {**self.history.in_force(but=suspects), **kept}
            raised = described_error(error, earlier, read, self.directory.name, bool(suspects), what_ends == ENDS)
        if earlier and not suspects and (read or what_ends != CALLBACK_RAISES):  # others raise as ever, and go on
            rospy.logerr('%s%s what was changed before\n%s', what_ends, 'from' if read else 'after', raised)
        for request in suspects:
            values = ', '.join(f'{one.name} = {new!r}' for one, (_, new) in request.changes.items())
            others = [other.changes for other in suspects if other is not request]
            request.raised = with_effects(raised, what_ends == ENDS, others)
            answer = self.change_sources(
                srv.ChangeSourcesRequest(undo=True, request_id=request.id, requester=self.name)
            )
            states.append(answer.state)
            done = 'is taken back' if answer.state == APPLIED else 'stays: ' + '; '.join(answer.reasons)
            rospy.logerr('%safter a change, which %s: %s\n%s', what_ends, done, values, raised)
        self._calls.look_again()
        if what_ends == ENDS:
            self._wait_until_asked(suspects)
            if suspects and not self.parameters.wait_for_all():
                rospy.logerr('what is taken back is not set at the master, which does not answer')
        return set(states) == {APPLIED}

    def _wait_until_asked(self, requests: Sequence[Request]) -> None:
        """The process ends: wait, for AWAITED at most, until those who made the last requests know their outcome."""
        start = time.monotonic()
        awaited = [one for one in requests if one.asked_in or one.at > start - AWAITED]
        with self._asked:
            self._asked.wait_for(lambda: all(one.asked_in for one in awaited), AWAITED)
        for thread in [one.asked_in for one in awaited if one.asked_in]:
            thread.join(max(0.0, start + AWAITED - time.monotonic()))

    def outcome_of(self, request_id: str) -> srv.ChangeSourcesResponse:
        """Answer whether this node keeps what a request has changed, once the callbacks that it calls often were called
        and the main program has gone round its loop; the reason is the exception that one has raised."""
        request = self.history.last_part(request_id)
        if request is None:
            return srv.ChangeSourcesResponse(state=UNKNOWN, reasons=['this node does not know the request'])
        with self._asked:
            request.asked_in = threading.current_thread()
            self._asked.notify_all()
        with watch_round(self._calls.look_again) as main:
            self._calls.wait_since(request.at, lambda: request.undone, lambda: main.is_over and not self.main_ends)
        if request.undone and request.raised:
            return srv.ChangeSourcesResponse(state=ABORTED, reasons=[request.raised])
        return srv.ChangeSourcesResponse(state=APPLIED)

    def outdated_by(self, request_id: str) -> List[str]:
        """Name what in this node's memory still holds results of the values before a request."""
        request = self.history.last_part(request_id)
        return [] if request is None else outdated(request.present())

    def _hold(self, value: object, least: int, greatest: int) -> None:
        """Limit a location to the numbers that its field in a message can hold: rospy ends a node that sends others."""
        (source,) = values.origins([value]) or (None,)
        location = self.locations.by_id.get(source.location_id) if source is not None else None
        if location is not None and location.source == source and location.type is int:
            former, location.sendable = (
                location.sendable,
                (
                    max(least, location.sendable[0]),
                    min(greatest, location.sendable[1]),
                ),
            )
            if former != location.sendable:
                self.publish_locations()

    def changeable(self, location: Location, requester: str) -> Location:
        """A location that takes changes of that requester; raises Refused if it does not."""
        self.access.check(location.name, requester)
        self.check_goes_on(requester)
        if location.read_only:
            raise Refused(f'{location.name} is read-only')
        if isinstance(location, ParameterLocation):
            self.read_parameters.check_other_readers([location])
        return location

    def check_goes_on(self, requester: str) -> None:
        """Raises Refused if this node ends, and takes changes from itself alone."""
        if self.main_ends and requester != self.name:
            raise Refused('the node ends: its main program has raised an exception')

    def apply(
        self, wanted: Sequence[Tuple[Location, Scalar]], requester: str, request_id: str = '', record: bool = True
    ) -> Tuple[List[str], List[Change]]:
        """Put checked values in force, all or none; the lock is held, and given up while setters are called.

        Returns:
            (the reasons of refusals, one a location, empty if there is none; what has changed).
        """
        # Setters first: while the lock is given up for them, others may change what this node holds.
        order = sorted(range(len(wanted)), key=lambda index: isinstance(wanted[index][0], HeldLocation))
        done: Dict[int, Change] = {}
        with self._participant.hold([location for location, _ in wanted], requester):
            for index in order:
                location, value = wanted[index]
                try:
                    if self.known(location.id) is not location:
                        raise Refused(f'{location.name} was replaced meanwhile; list the locations and try again')
                    if type(value) is not location.type:  # of a parameter that has another type since
                        value = location.checked(value)
                    done[index] = (location, *location.set_outside(value))
                except Refused as refused:
                    return self._refused_at(index, refused, len(wanted), list(done.values())), []
            changes = [done[index] for index in range(len(wanted))]
            try:
                put_in_force([(location, new) for location, _, new in changes])
            except Refused as refused:
                return self._refused_at(0, refused, len(wanted), list(done.values())), []
        self.applied(changes, requester, request_id, record)
        return [''] * len(wanted), changes

    def _refused_at(self, index: int, refused: Refused, count: int, done: Sequence[Change]) -> List[str]:
        """Take back values that setters have set; returns the reasons of `count` refusals."""
        rospy.logerr('%s', refused)
        reasons = [''] * count
        reasons[index] = '; '.join([str(refused), *self._put_back(done)])
        return reasons

    def _put_back(self, changes: Sequence[Change]) -> List[str]:
        """Give locations their old values again; returns the value and the reason for each that keeps its new one."""
        left = []
        for location, old, new in reversed(changes):
            try:
                location.set_outside(old)
            except Refused as refused:
                if self.locations.by_id.get(location.id) is not location:
                    continue  # it is gone, as is a number of a script that was saved anew meanwhile
                left.append(f'not taken back: {location.name} = {new!r} ({refused})')
                rospy.logerr('%s stays changed in spite of a refusal elsewhere: %s', location.name, refused)
        return left

    def follow(self, changed: Iterable[Location]) -> int:
        """Have the parameters of locations follow them; returns what `wait_for_parameters` waits for."""
        return self.parameters.write(*(one for one in changed if isinstance(one, (LiteralLocation, ParameterLocation))))

    def _list_locations(self, request: srv.ListLocationsRequest) -> srv.ListLocationsResponse:
        if request.all:
            self.make_all_known()
        with self.lock:
            asked = request.location_ids or list(self.locations.by_id)
            found = [self.locations.by_id[one] for one in asked if one in self.locations.by_id]
            return srv.ListLocationsResponse(all_described(found, self.access.lock_of, self.read_parameters.set_for))

    def _described(self, location_id: int) -> Optional[msg.Location]:
        """A location as a message; None if this node has no location of that id."""
        location = self.locations.by_id.get(location_id)
        return location and described(location, self.access.lock_of(location.name))

    def _list_edits(self, _request: srv.ListEditsRequest) -> srv.ListEditsResponse:
        stale = self.look_at_files()
        with self.lock:
            edits, left = SOURCE_FILES.edits(self.locations.by_id.values())
            return edits_described(edits, left, SOURCE_FILES.places(self.locations.by_id.values()), stale)

    def reread(self, location: Location, value_in_code: Scalar, is_saved_here: bool) -> bool:
        """Take in what the code says of a location since it was edited, and have it in force.

        Args:
            is_saved_here: it was written there by a save: the value in force may be a newer one, and stays.

        Returns:
            Whether that is new. If it was taken in before, the value in force may be a newer one, and stays.

        Raises:
            Refused: the location does not take it; it stays as it is.
        """
        with self.lock:
            value = location.checked(value_in_code)
            if value == location.value_in_code:
                return False
            if not is_saved_here:
                self.set_value(location, value, EDITOR)
            location.reread(value)
            self.parameters.write_again(location)
            return True

    def _get_history(self, request: srv.GetHistoryRequest) -> srv.GetHistoryResponse:
        with self.lock:
            self._claim_changes()
            return srv.GetHistoryResponse(self.history.messages(request.request_id, request.limit))

    def _source_change(self, change: msg.SourceChange) -> None:
        if rospy.names.canonicalize_name(change.node) != self.name:
            return
        requester = change.requester or change._connection_header.get('callerid', '')
        response = self.change_sources(
            srv.ChangeSourcesRequest(requester=requester, location_ids=[change.location_id], values=[change.value])
        )
        if response.state != APPLIED:
            rospy.logerr('/rosslt/source_change from %s is refused: %s', requester, response.reasons[0])

    def set_value(self, location: Location, value: object, requester: str) -> None:
        """Change one location, if it has another value.

        Raises:
            Refused: it is not changed.
        """
        with self.lock:
            value = location.checked(value)
            if value != location.value:
                self._participant.wait_for([location])
                reasons, _ = self.apply([(self.changeable(location, requester), value)], requester)
                if any(reasons):
                    raise Refused(reasons[0])

    def set_setting(self, name: str, value: object) -> None:
        """Take over one of the node's settings that was set; None if it was deleted."""
        value = {} if value is None else value
        if name in locks.SETTINGS:
            try:
                self.access.set(name, value)
            except Refused as refused:
                rospy.logerr('%s/rosslt/%s: %s', self.name, name, refused)
            else:
                self.publish_locations()
        else:
            fault = Sending.set(name, value)
            if fault:
                rospy.logerr('%s/rosslt/%s is %s', self.name, name, fault)
