"""A ROS 1 node (rospy).

    ros_node.py talk NAME TOPIC BYTES HZ
    ros_node.py hear NAME TOPIC

Messages are occupancy grids of so many bytes. HZ 0: one, latched. It prints its first instant, the
instant of its call, and each message: its number, when it came, when it was published.
"""

import sys
import time

import rospy
from nav_msgs.msg import OccupancyGrid

FRAME = "/p3dx0_tf/map"
FIXED_BYTES = 96 + len(FRAME)


def talk(topic, size, rate):
    publisher = rospy.Publisher(topic, OccupancyGrid, queue_size=10, latch=not rate)
    called = time.time()
    grid = OccupancyGrid()
    grid.header.frame_id, grid.data = FRAME, bytes(size - FIXED_BYTES)
    number = 0
    while not rospy.is_shutdown():
        grid.header.stamp = rospy.Time.from_sec(time.time())
        grid.info.width = number
        publisher.publish(grid)
        number += 1
        if not rate:
            rospy.spin()
        time.sleep(max(called + number / rate - time.time(), 0))


def hear(topic):
    def heard(grid):
        born = grid.header.stamp.to_sec()
        sys.stdout.write(f"heard {grid.info.width} {time.time():.9f} {born:.9f}\n")

    rospy.Subscriber(topic, OccupancyGrid, heard, queue_size=2000)
    rospy.spin()


sys.stdout.write(f"began {time.time():.9f}\n")
rospy.init_node(sys.argv[2], disable_rosout=True)
sys.stdout.write(f"called {time.time():.9f}\n")
if sys.argv[1] == "talk":
    talk(sys.argv[3], int(sys.argv[4]), float(sys.argv[5]))
else:
    hear(sys.argv[3])
