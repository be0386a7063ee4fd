"""The room of interactive markers: which of them follow from tracked visualizations, and what a drag changes.

The paper's `slt_visualization` (section V). It may import the rooms below, and rospy; `models` only once something was
learned of a node. Two parts know nothing of how things are shown: `scene` says which handles there are, and `drags`
what a drag of one changes. `rviz` shows a scene as interactive markers; the room `web` shows the same one on a page.
"""

from rosslt.markers import geometry
from rosslt.markers.describing import Descriptions
from rosslt.markers.drags import joint_limits, mouse
from rosslt.markers.drags.other_views import OtherViews
from rosslt.markers.drags.scene_drags import Drags, Rules
from rosslt.markers.drags.waypoints import plan_drag, solve_waypoints
from rosslt.markers.drags.wording import HELD, refusal, short_numbers
from rosslt.markers.faults import contained
from rosslt.markers.offers import FREE, HEADING, HOLD, ROW, ROW_OPERATIONS, UNDO, Choice, Offers
from rosslt.markers.rviz.configuration import GHOST, open_rviz
from rosslt.markers.rviz.controls import pose_message
from rosslt.markers.rviz.node import run
from rosslt.markers.rviz.standby import wait_for_turn
from rosslt.markers.scene.by_type import KINDS
from rosslt.markers.scene.follower import FRAME_RATE, Follower
from rosslt.markers.scene.handle import Handle, Motions, Settings
from rosslt.markers.scene.joints import robot_for
from rosslt.markers.scene.links import RobotPose
from rosslt.markers.scene.numbers import NumbersHandle
from rosslt.markers.scene.scene import Scene
from rosslt.markers.scene.selection import Selection
from rosslt.markers.scene.shapes import plain_pose
from rosslt.markers.scene.topics import Graph, Watch, is_visible
from rosslt.markers.tf_frames import heard_frames, most_common_root
