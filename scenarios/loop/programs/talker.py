"""Publishes a text twenty times a second (rospy)."""

import rospy
from std_msgs.msg import String

rospy.init_node("talker")
publisher = rospy.Publisher("chatter", String, queue_size=10)
rate = rospy.Rate(20)
number = 0
while not rospy.is_shutdown():
    number += 1
    publisher.publish(f"{number} at {rospy.get_time():.6f} ".ljust(800, "x"))
    rate.sleep()
