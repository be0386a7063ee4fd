"""This node as the owner of its locations: what it tells of them, and the changes that it takes.

The paper's `apply_source_change` and the service for reevaluation (section IV-A, figure 3): the services
`<node>/rosslt/change_sources`, `get_values`, `list_locations` and `undo`, the topics `/rosslt/source_change`
and `<node>/rosslt/changes`, and the parameters `<node>/rosslt/accept_changes` and `history`.
"""

import os
from collections import deque

import rospy
from std_srvs.srv import Trigger, TriggerResponse

from rosslt import msg, srv, values
from rosslt.node.calls import ask_all
from rosslt.node.carriers import Sending
from rosslt.node.facts import Facts
from rosslt.node.locations import Locations, Refused, call_site, from_json, to_json
from rosslt.node.master_watch import MasterWatch
from rosslt.node.parameter_tree import ParameterTrees
from rosslt.node.parameters import LiteralParameter, ParameterMirror

#: How long an acknowledgement waits for the parameter server to follow, in seconds; the change holds all the
#: same.
FOLLOW_TIMEOUT = 1.0

#: Parameters in the namespace of the locations that are settings of the node.
SETTINGS = {'accept_changes', 'history'}

#: How many changes can be taken back.
HISTORY = 1000


class Owner:
    """The locations of this node, in the ROS graph.

    Attributes:
        name: the full name of the node.
        locations: its Locations.
        mirror: the ParameterMirror behind them.
        facts: what this node knows of sources, its own and others'.
        lock: that of the locations.
        locked: why no change is taken now; empty where changes are.
    """

    def __init__(self):
        self.name = rospy.get_name()
        self.locations = Locations(self.name)
        self.lock = self.locations.lock
        self.locked = ''
        self._trees = ParameterTrees(self)
        self._history = deque(maxlen=HISTORY)
        self.mirror = ParameterMirror(self.name, self._namespace_set)
        for setting in SETTINGS & self.mirror.left_behind.keys():
            self._namespace_set(setting, self.mirror.left_behind[setting])
        self._changes = rospy.Publisher('~rosslt/changes', msg.AppliedChange, queue_size=HISTORY)
        rospy.Service('~rosslt/change_sources', srv.ChangeSources, self.change_sources)
        rospy.Service('~rosslt/get_values', srv.GetValues, self.get_values)
        rospy.Service('~rosslt/list_locations', srv.ListLocations, self._list_locations)
        rospy.Service('~rosslt/undo', Trigger, self._undo)
        rospy.Subscriber('/rosslt/source_change', msg.SourceChange, self._source_change)
        MasterWatch(self.name, self.mirror.renew)
        self.facts = Facts(self.locations, _ask_for_locations)
        values.describe_sources_with(self.facts.place)

    def add_literal(self, location, is_written=True):
        """Take in the location of a literal, with a parameter behind it; returns the one that is in force.

        Args:
            location: the HeldLocation.
            is_written: whether the parameter shows the literal before it has been changed.
        """
        with self.lock:
            in_force = self.locations.add(location)
            if in_force is location:
                location.parameter = LiteralParameter(self.name, location, self._parameter_set)
                location.parameter.take_over(self.mirror.left_behind, self.mirror.literals)
                self.mirror.add(location.parameter)
                if is_written:
                    self.mirror.write(location.parameter)
        return in_force

    def parameter(self, key, frame, *default):
        """What reads the ROS parameter of that full name as a source.

        Raises:
            KeyError: the parameter is not set, and there is no default.
        """
        known = self._trees.get(key)
        if known is None:
            with self.lock:
                known = self._trees.at(key, call_site(frame), self.mirror.read(key, *default))
        return known

    def change_sources(self, request):
        """Change several locations, all or nothing; serves `~rosslt/change_sources`."""
        ids, texts = list(request.location_ids), list(request.values)
        if len(ids) != len(texts):
            raise rospy.ServiceException(f'{len(ids)} location ids with {len(texts)} values')
        with self.lock:
            wanted, reasons, old = [], [], []
            for location_id, text in zip(ids, texts):
                before = ''
                try:
                    location = self._known(location_id)
                    before = to_json(location.value)
                    wanted.append((location, self._changeable(location).checked(from_json(text))))
                    reasons.append('')
                except Refused as refused:
                    reasons.append(str(refused))
                old.append(before)
            if not any(reasons):
                reasons = self._apply(wanted, request.requester)
            if any(reasons):
                return srv.ChangeSourcesResponse(False, reasons, old, old)
            new = [to_json(location.value) for location, _ in wanted]
            written = self.mirror.write(*self._parameters(wanted))
        if not self.mirror.wait(written, FOLLOW_TIMEOUT):
            rospy.logwarn('the change is in force, but the parameter server does not follow')
        return srv.ChangeSourcesResponse(True, reasons, old, new)

    def get_values(self, request):
        """The current values of several locations; serves `~rosslt/get_values`."""
        texts, reasons = [], []
        for location_id in request.location_ids:
            try:
                texts.append(to_json(self._known(location_id).value))
                reasons.append('')
            except Refused as refused:
                texts.append('')
                reasons.append(str(refused))
        return srv.GetValuesResponse(texts, reasons)

    def undo(self):
        """Take the last change of this node's locations back.

        Returns:
            [(location, value until now, value that it has again)], empty where there is nothing to take back.

        Raises:
            Refused: no change is taken now, or a setter refuses the old value.
        """
        with self.lock:
            if not self._history:
                return []
            back = [(self._changeable(location), old) for location, old in self._history[-1]]
            undone = [(location, location.value, old) for location, old in back]
            reasons = self._apply(back, 'undo', record=False)
            if any(reasons):
                raise Refused('; '.join(filter(None, reasons)))
            self._history.pop()
            written = self.mirror.write(*self._parameters(back))
        self.mirror.wait(written, FOLLOW_TIMEOUT)
        return undone

    def applied(self, location, old, new, requester):
        """Tell of a change that has been applied."""
        if type(old) is not type(new) or old != new:
            self._changes.publish(
                stamp=rospy.Time.now(),
                location_id=location.id,
                name=location.name,
                old_value=to_json(old),
                new_value=to_json(new),
                requester=requester,
            )

    def _known(self, location_id):
        location = self.locations.by_id.get(location_id)
        if location is None:
            raise Refused(f'{self.name} has no location {location_id}')
        return location

    def _changeable(self, location):
        if self.locked:
            raise Refused(self.locked)
        if location.read_only:
            raise Refused(f'{location.name} is read-only')
        return location

    def _apply(self, wanted, requester, record=True):
        """Put checked values in force, all or none.

        Returns:
            The reasons of refusals, one a location, empty where there is none.
        """
        before = []
        for location, value in wanted:
            before.append((location, location.value))
            try:
                location.put(value)
            except Refused as refused:
                rospy.logerr('%s', refused)
                self._put_back(before[:-1])
                reasons = [''] * len(wanted)
                reasons[len(before) - 1] = str(refused)
                return reasons
        for location, old in before:
            self.applied(location, old, location.value, requester)
        if record and any(old != location.value for location, old in before):
            self._history.append(before)
        return [''] * len(wanted)

    def _put_back(self, before):
        for location, old in reversed(before):
            try:
                location.put(old)
            except Refused as refused:
                rospy.logerr('%s stays changed in spite of a refusal elsewhere: %s', location.name, refused)

    def _parameters(self, pairs):
        return [location.parameter for location, _ in pairs if location.parameter is not None]

    def _list_locations(self, request):
        asked = request.location_ids or self.locations.by_id

        def bound(value):
            return '' if value is None else to_json(value)

        return srv.ListLocationsResponse(
            [
                msg.Location(
                    id=location.id,
                    name=location.name,
                    file=os.path.realpath(location.site.file),
                    line=location.site.line,
                    column=location.site.column,
                    type=location.type.__name__,
                    value=to_json(location.value),
                    minimum=bound(location.minimum),
                    maximum=bound(location.maximum),
                    read_only=location.read_only,
                    rank=location.rank,
                )
                for location in map(self.locations.by_id.get, list(asked))
                if location is not None
            ]
        )

    def _undo(self, _request):
        try:
            back = self.undo()
        except Refused as refused:
            return TriggerResponse(False, str(refused))
        text = ', '.join(f'{location.name} = {to_json(value)}' for location, _, value in back)
        return TriggerResponse(bool(back), text or 'there is no change to take back')

    def _source_change(self, change):
        if rospy.names.canonicalize_name(change.node) != self.name:
            return
        requester = change.requester or change._connection_header.get('callerid', '')
        response = self.change_sources(srv.ChangeSourcesRequest([change.location_id], [change.value], requester))
        if not response.applied:
            rospy.logerr('/rosslt/source_change from %s is refused: %s', requester, response.reasons[0])

    def _parameter_set(self, location, value):
        """`rosparam set` of the parameter behind a literal; raises Refused."""
        with self.lock:
            value = location.checked(value)
            if value != location.value:
                reasons = self._apply([(self._changeable(location), value)], 'parameter server')
                if any(reasons):
                    raise Refused(reasons[0])

    def _namespace_set(self, name, value):
        """`rosparam set` of what stands in the namespace of the locations and is none."""
        if name == 'accept_changes':
            accepted = value is True or value == {}
            self.locked = (
                ''
                if accepted
                else (f'{self.name} takes no changes now: {self.name}/rosslt/accept_changes is {to_json(value)}')
            )
            rospy.loginfo('%s', self.locked or self.name + ' takes changes')
        elif name == 'history':
            Sending.full_history = value == 'full'
            if value not in ('full', 'folded', {}):
                rospy.logerr(
                    "%s/rosslt/history is %r instead of 'full' or 'folded': taken for 'folded'", self.name, value
                )
        elif value == {}:
            self.mirror.left_behind.pop(name, None)
        else:
            self.mirror.left_behind[name] = value  # perhaps that of a location which is created later


def _ask_for_locations(ids_by_node, timeout):
    requests = {node: srv.ListLocationsRequest(ids) for node, ids in ids_by_node.items()}
    answers, _ = ask_all('list_locations', srv.ListLocations, requests, timeout)
    return {node: answer.locations for node, answer in answers.items()}
