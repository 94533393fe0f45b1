"""Prints when each text of the talker came, and how long it took (rospy)."""

import rospy
from std_msgs.msg import String


def heard(text):
    now = rospy.get_time()
    number, _, born = text.data.split()[:3]
    print(f"{number} {now:.6f} {1e3 * (now - float(born)):.3f} ms")


rospy.init_node("listener", anonymous=True)
rospy.Subscriber("chatter", String, heard, tcp_nodelay=True)
rospy.spin()
