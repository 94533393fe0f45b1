"""The software of one robot. It knows only what it sensed and what it received.

A scan becomes a map in ``mapping.py`` (``tiles.py`` keeps the map, ``kernels/evidence.py`` has the
loops) and a map becomes a costmap in ``navigation/global_costmap.py``. The same scan becomes the
local costmap in ``navigation/local_costmap.py``.

Three decisions are plug-ins. ``coordination/``, ``sharing/`` and ``localization/`` each have the
node that calls one, its ``context.py`` (what the plug-in knows and can do), and what several
plug-ins use. The plug-ins are in a folder of their own, a file for each:
``coordination/strategies/``, ``sharing/kinds/``, ``localization/kinds/``.
"""
