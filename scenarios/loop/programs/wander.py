"""Drives the robot of its namespace about: ahead where there is room, else it turns (rospy)."""

import math

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

NEAR = 1.2  # m ahead at which it turns


def nearest(scan, from_angle, to_angle):
    """The shortest beam between two angles."""
    first = int((from_angle - scan.angle_min) / scan.angle_increment)
    last = int((to_angle - scan.angle_min) / scan.angle_increment)
    return min(scan.ranges[max(first, 0):last + 1], default=scan.range_max)


def drive(scan):
    """Answer a scan with a velocity."""
    ahead = nearest(scan, -0.4, 0.4)
    left, right = nearest(scan, 0.4, math.pi / 2), nearest(scan, -math.pi / 2, -0.4)
    velocity = Twist()
    if ahead > NEAR:
        velocity.linear.x = min(1.0, ahead - NEAR)
        velocity.angular.z = 0.8 * (left - right) / (left + right)
    else:
        velocity.angular.z = 1.5 if left > right else -1.5
    motors.publish(velocity)


rospy.init_node("wander", anonymous=True)
motors = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
rospy.Subscriber("scan", LaserScan, drive, queue_size=1, tcp_nodelay=True)
rospy.spin()
