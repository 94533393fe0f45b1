"""A layout for Foxglove, in which a recording is seen without set-up."""

from __future__ import annotations

import json
from importlib.resources import files

from desim.export.extent import extent_of
from desim.export.ros.laser_scans import scan_topics
from desim.results.recording import Recording
from desim.results.seal import Json

_SCENE, _SPEEDS = "3D!desim", "Plot!speeds"
_VIEW = 0.9  # of the larger side of the terrain, from above


def layout(recording: Recording) -> Json:
    """``foxglove_layout.json`` with the topics and the extent of ``recording``."""
    text = (files("desim.export.ros") / "foxglove_layout.json").read_text("utf-8")
    found: Json = json.loads(text)
    panels = found["configById"]
    scene = panels[_SCENE]
    for number, robot in enumerate(recording.robots):
        for topic in scan_topics(recording, number):
            scene["topics"][topic] = {
                "visible": True, "colorMode": "flat", "flatColor": "#e69f0055", "pointSize": 2}
        scene["topics"] |= {
            f"/{robot}/plan": {"visible": True, "lineWidth": 0.08},
            f"/{robot}/goal": {"visible": True, "type": "arrow", "arrowScale": [0.8, 0.15, 0.15]},
            f"/{robot}/map": {"visible": False}, f"/{robot}/odom": {"visible": False}}
    panels[_SPEEDS]["paths"] = [
        {"value": f"/{robot}/odom.twist.twist.linear.x", "enabled": True, "label": robot,
         "timestampMethod": "receiveTime"} for robot in recording.robots[:6]]
    extent = extent_of(recording)
    if extent is not None:
        scene["cameraState"] |= {"distance": extent.side_m * _VIEW,
                                 "targetOffset": [*extent.middle_m, 0]}
    return found
