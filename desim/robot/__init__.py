"""The software of one robot. It knows only what it sensed and what it received.

``software.py`` lists the nodes of a robot. A scan becomes a map in ``mapping/``, and a map becomes
a costmap in ``navigation/global_costmap.py``, on which ``navigation/global_planner.py`` finds
frontiers and paths. The same scan becomes the local costmap in ``navigation/local_costmap.py``.
SLAM, which makes pose and map together, is in ``slam/``.

Three decisions are plug-ins. ``coordination/``, ``sharing/`` and ``localization/`` each have the
node that calls one, its ``context.py`` (what the plug-in knows and can do), and what several
plug-ins use. The plug-ins are in a folder of their own, a file for each:
``coordination/strategies/``, ``sharing/kinds/``, ``localization/kinds/``. The fleet's task is no
part of a robot: ``desim/monitor/tasks/``.
"""
