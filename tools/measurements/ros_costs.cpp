// How much processor time does a process of roscpp need for its messages, calls and transforms?
//
// With ROS 1 of Debian 12 (libroscpp-dev, libtf2-ros-dev, libnav-msgs-dev, rosmaster running):
//
//   g++ -O2 ros_costs.cpp -o ros_costs -lroscpp -lrostime -lroscpp_serialization -lrosconsole
//       -lboost_thread -ltf2_ros -ltf2 -lxmlrpcpp
//   ./ros_costs publish NAME RATE_HZ BYTES & ./ros_costs subscribe NAME2
//
// It warms up for 2 s, works for 12 s and prints user and system time of these 12 s (getrusage),
// the number of messages, calls or transforms, and its resident memory. docs/computers.md has
// what came out, less an idle process.

#include <nav_msgs/OccupancyGrid.h>
#include <ros/master.h>
#include <ros/ros.h>
#include <sys/resource.h>
#include <tf2_ros/transform_listener.h>

#include <fstream>
#include <functional>
#include <memory>
#include <string>

namespace {

constexpr double kWarmUp = 2, kTime = 12;

struct Times {
  double user, system;
};

Times used() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  auto seconds = [](const timeval& time) { return time.tv_sec + time.tv_usec * 1e-6; };
  return {seconds(usage.ru_utime), seconds(usage.ru_stime)};
}

std::string resident_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmRSS:", 0) == 0) return line.substr(6);
  return "?";
}

// Stores three transforms of one instant, and looks their chain up `count` times.
void look_up(tf2_ros::Buffer& buffer, int count) {
  const char* frames[] = {"map", "odom", "base_footprint", "base_link"};
  const ros::Time now = ros::Time::now();
  for (int i = 0; i < 3; ++i) {
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = now;
    transform.header.frame_id = frames[i];
    transform.child_frame_id = frames[i + 1];
    transform.transform.rotation.w = 1;
    buffer.setTransform(transform, "here");
  }
  for (int i = 0; i < count; ++i) buffer.lookupTransform("map", "base_link", ros::Time(0));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string what = argv[1];
  ros::init(argc, argv, argv[2]);
  ros::NodeHandle node;
  const double rate = argc > 3 ? std::stod(argv[3]) : 2;
  const int size = argc > 4 ? std::stoi(argv[4]) : 0;
  long count = 0;

  ros::Publisher publisher;
  ros::Subscriber subscriber;
  tf2_ros::Buffer buffer;
  std::unique_ptr<tf2_ros::TransformListener> listener;
  nav_msgs::OccupancyGrid map;
  map.data.resize(size);
  std::function<void()> act = [] {};  // idle, subscribe, listen
  if (what == "publish") {
    publisher = node.advertise<nav_msgs::OccupancyGrid>("costs", 1);
    act = [&] { publisher.publish(map), ++count; };
  } else if (what == "subscribe") {
    subscriber = node.subscribe<nav_msgs::OccupancyGrid>(
        "costs", 1, [&](const nav_msgs::OccupancyGrid::ConstPtr&) { ++count; });
  } else if (what == "listen") {
    listener = std::make_unique<tf2_ros::TransformListener>(buffer, node, false);
  } else if (what == "look_up") {
    act = [&] { look_up(buffer, size), count += size; };
  } else if (what == "topics") {
    act = [&] { ros::master::V_TopicInfo topics; ros::master::getTopics(topics), ++count; };
  } else if (what == "parameters") {
    act = [&] { double value; node.getParam("/costs", value), ++count; };
  }

  ros::AsyncSpinner spinner(1);
  spinner.start();
  const ros::WallTime start = ros::WallTime::now();
  auto work = [&](double until) {
    for (ros::WallRate every(rate); (ros::WallTime::now() - start).toSec() < until; every.sleep())
      act();
  };
  work(kWarmUp);
  const Times before = used();
  const long first = count;
  work(kWarmUp + kTime);
  const Times after = used();
  std::printf("%s: user %.4f s, system %.4f s, %ld done, resident %s\n", what.c_str(),
              after.user - before.user, after.system - before.system, count - first,
              resident_memory().c_str());
}
