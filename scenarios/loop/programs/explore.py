"""Explores with the robot of its namespace: sends it to places beside the unknown (rospy).

desim maps and navigates (``loop.navigation``); this decides where to.
"""

import math

import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid
from tf2_msgs.msg import TFMessage

STEP = 4  # cells between places that are considered
GIVE_UP = 20.0  # s after which another place is chosen


class Explorer:
    """Knows the newest map and pose."""

    def __init__(self):
        self._links = {}  # of frames: parent and child to x, y, yaw
        self._tried = []
        self._goal, self._since = None, 0.0
        self._goals = rospy.Publisher("move_base_simple/goal", PoseStamped, queue_size=1)
        rospy.Subscriber("/tf", TFMessage, self._transformed, queue_size=100)
        rospy.Subscriber("map", OccupancyGrid, self._choose, queue_size=1)

    def _transformed(self, message):
        for one in message.transforms:
            at, turn = one.transform.translation, one.transform.rotation
            self._links[one.header.frame_id, one.child_frame_id] = (
                at.x, at.y, 2 * math.atan2(turn.z, turn.w))

    def _place(self):
        """The place of the robot on the map; None before that is known."""
        robot = rospy.get_namespace().strip("/")
        try:
            x, y, yaw = self._links["map", f"{robot}/odom"]
            dx, dy, _ = self._links[f"{robot}/odom", f"{robot}/base_link"]
        except KeyError:
            return None
        return (x + math.cos(yaw) * dx - math.sin(yaw) * dy,
                y + math.sin(yaw) * dx + math.cos(yaw) * dy)

    def _choose(self, grid):
        """Choose the nearest free place beside the unknown that was not tried yet."""
        here, now = self._place(), rospy.get_time()
        if here is None or (self._goal is not None and now - self._since < GIVE_UP
                            and math.dist(here, self._goal) > 1.0):
            return
        info, data = grid.info, grid.data
        best, best_m = None, math.inf
        for row in range(STEP, info.height - STEP, STEP):
            for column in range(STEP, info.width - STEP, STEP):
                cell = row * info.width + column
                if data[cell] != 0 or -1 not in (data[cell - STEP], data[cell + STEP],
                                                 data[cell - STEP * info.width],
                                                 data[cell + STEP * info.width]):
                    continue
                place = (info.origin.position.x + (column + 0.5) * info.resolution,
                         info.origin.position.y + (row + 0.5) * info.resolution)
                away = math.dist(place, here)
                if 1.0 < away < best_m and all(math.dist(place, old) > 1.0 for old in self._tried):
                    best, best_m = place, away
        if best is None:
            return
        self._goal, self._since = best, now
        self._tried.append(best)
        goal = PoseStamped()
        goal.header.stamp, goal.header.frame_id = rospy.Time.now(), "map"
        goal.pose.position.x, goal.pose.position.y = best
        goal.pose.orientation.w = 1.0
        self._goals.publish(goal)
        print(f"{now:.3f} from {here[0]:.2f} {here[1]:.2f} to {best[0]:.2f} {best[1]:.2f}",
              flush=True)


rospy.init_node("explore", anonymous=True)
explorer = Explorer()
rospy.spin()
