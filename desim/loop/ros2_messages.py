"""ROS 2's messages as types of Cyclone DDS: names, fields and bytes (XCDR1) as ROS 2 has them.

    message = make("geometry_msgs/Twist", {"linear": {"x": 0.5}})
"""

from functools import cache

from cyclonedds.idl import make_idl_struct, types

# As their .msg files (common_interfaces, rcl_interfaces, geometry2 of Humble) have them.
DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp, string frame_id",
    "geometry_msgs/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position, geometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseStamped": "std_msgs/Header header, geometry_msgs/Pose pose",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose, float64[36] covariance",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear, geometry_msgs/Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist, float64[36] covariance",
    "geometry_msgs/Transform":
        "geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped":
        "std_msgs/Header header, string child_frame_id, geometry_msgs/Transform transform",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/Odometry":
        "std_msgs/Header header, string child_frame_id, geometry_msgs/PoseWithCovariance pose, "
        "geometry_msgs/TwistWithCovariance twist",
    "nav_msgs/MapMetaData":
        "builtin_interfaces/Time map_load_time, float32 resolution, uint32 width, uint32 height, "
        "geometry_msgs/Pose origin",
    "nav_msgs/OccupancyGrid": "std_msgs/Header header, nav_msgs/MapMetaData info, int8[] data",
    "sensor_msgs/LaserScan":
        "std_msgs/Header header, float32 angle_min, float32 angle_max, float32 angle_increment, "
        "float32 time_increment, float32 scan_time, float32 range_min, float32 range_max, "
        "float32[] ranges, float32[] intensities",
}
# The basic types, with their zeros.
_BASIC = {"int8": (types.int8, 0), "int32": (types.int32, 0), "uint32": (types.uint32, 0),
          "float32": (types.float32, 0.0), "float64": (types.float64, 0.0), "string": (str, "")}


@cache
def kind(name):
    """The type sensor_msgs::msg::dds_::LaserScan_ of the message sensor_msgs/LaserScan."""
    package, _, message = name.partition("/")
    return make_idl_struct(message, f"{package}.msg.dds_.{message}_", {
        field: _type(declared) for field, declared in fields(name)})


def fields(name):
    """Pairs of the name of a field and its type as the definition has it."""
    return [tuple(reversed(field.split(" "))) for field in DEFINITIONS[name].split(", ")]


def make(name, given):
    """A message with the fields that are ``given``, which may be messages, mappings of their
    fields, or times in ns. All others are zero."""
    return kind(name)(*(_value(declared, given.get(field)) for field, declared in fields(name)))


def _type(declared):
    inner, bracket, count = declared.rstrip("]").partition("[")
    one = _BASIC[inner][0] if inner in _BASIC else kind(inner)
    if not bracket:
        return one
    return types.array[one, int(count)] if count else types.sequence[one]


def _value(declared, given):
    inner, bracket, count = declared.rstrip("]").partition("[")
    if bracket:
        return [_value(inner, None)] * int(count or 0) if given is None else given
    if inner in _BASIC:
        return _BASIC[inner][1] if given is None else given
    if isinstance(given, int):
        given = dict(zip(("sec", "nanosec"), divmod(given, 10**9), strict=True))
    return make(inner, given or {}) if given is None or isinstance(given, dict) else given
