"""What a node says, as JSON: `ask_node.py NODE SERVICE`.

The service is `read`, a Trigger that answers in JSON, or `rosslt/list_locations`, printed as `{name: id}`.
"""

import json
import sys

import rospy
from std_srvs.srv import Trigger


def main() -> None:
    node, service = sys.argv[1:]
    rospy.init_node('asker', anonymous=True, disable_signals=True)
    if service == 'read':
        print(rospy.ServiceProxy(node + '/read', Trigger)().message)
        return
    from rosslt.srv import ListLocations

    locations = rospy.ServiceProxy(f'{node}/{service}', ListLocations)().locations
    print(json.dumps({location.name: location.id for location in locations}))


if __name__ == '__main__':
    main()
