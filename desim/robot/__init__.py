"""The software of one robot. It knows only what it sensed and what it received.

A scan becomes a map in ``mapping.py`` (``tiles.py`` keeps the map, ``kernels/evidence.py`` has the
loops) and a map becomes a costmap in ``navigation/global_costmap.py``. The same scan becomes the
local costmap in ``navigation/local_costmap.py``.
"""
