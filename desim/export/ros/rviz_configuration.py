"""A configuration for rviz, of ROS 1 or of ROS 2, in which a recording is seen without set-up."""

from __future__ import annotations

import yaml

from desim import colours
from desim.export.extent import Extent, extent_of
from desim.export.ros.laser_scans import scan_topics, sonar_size
from desim.export.ros.markers import MAP_FRAME
from desim.export.ros.topics import is_latched
from desim.results.recording import Recording
from desim.results.seal import Json

_VIEW_PX = 720  # of the scene, which the terrain fills


def rviz_configuration(recording: Recording, version: int) -> str:
    """The configuration for ROS ``version`` 1 or 2: from above, with the map of all robots, the
    terrain, robots, links, plans, goals and scans."""
    package = "rviz" if version == 1 else "rviz_default_plugins"

    def display(kind: str, topic: str, **more: object) -> Json:
        name = "Marker Topic" if version == 1 and kind == "MarkerArray" else "Topic"
        where: object = topic if version == 1 else {
            "Value": topic, "Depth": 5, "History Policy": "Keep Last",
            "Reliability Policy": "Reliable",
            "Durability Policy": "Transient Local" if is_latched(topic) else "Volatile"}
        return {"Class": f"{package}/{kind}", "Name": topic.lstrip("/"), "Enabled": True,
                "Value": True, name: where, **more}

    displays = [display("Map", "/map", **{"Color Scheme": "map", "Alpha": 0.8})]
    displays += [display("MarkerArray", topic) for topic in ("/terrain", "/links", "/robots")]
    for number, robot in enumerate(recording.robots):
        colour = "; ".join(str(round(255 * part)) for part in
                           colours.of_robot(number))
        displays += [display("LaserScan", topic, **{
            "Style": "Points", "Size (Pixels)": 2, "Color Transformer": "FlatColor",
            "Color": colour, "Alpha": 0.5}) for topic in scan_topics(recording, number)]
        transducers = sonar_size(recording, number)
        if transducers:  # each message is the range of one
            displays.append(display("Range", f"/{robot}/sonar", **{
                "Color": colour, "Alpha": 0.3, "Buffer Length": transducers}))
        displays += [
            display("Path", f"/{robot}/plan", **{
                "Color": colour, "Line Style": "Billboards", "Line Width": 0.1}),
            display("Pose", f"/{robot}/goal", **{
                "Color": colour, "Shape": "Arrow", "Shaft Length": 0.6, "Head Length": 0.4,
                "Shaft Radius": 0.08, "Head Radius": 0.2})]
    return yaml.safe_dump({
        "Panels": [{"Class": f"{'rviz' if version == 1 else 'rviz_common'}/Displays",
                    "Name": "Displays"}],
        "Visualization Manager": {
            "Class": "", "Name": "root", "Enabled": True, "Value": True, "Displays": displays,
            "Global Options": {"Fixed Frame": MAP_FRAME, "Background Color": "238; 240; 243",
                               "Frame Rate": 30},
            "Tools": [{"Class": f"{package}/MoveCamera"}, {"Class": f"{package}/Select"}],
            "Views": {"Current": _from_above(recording, package)}},
        "Window Geometry": {"Width": 1280, "Height": 960}}, sort_keys=False)


def _from_above(recording: Recording, package: str) -> Json:
    """A view of all of the terrain."""
    extent = extent_of(recording) or Extent(-1.0, -1.0, 1.0, 1.0)
    x_m, y_m = extent.middle_m
    return {"Class": f"{package}/TopDownOrtho", "Name": "Current View", "Value": "TopDownOrtho",
            "Target Frame": "<Fixed Frame>", "Angle": 0, "Scale": _VIEW_PX / extent.side_m,
            "X": x_m, "Y": y_m}
