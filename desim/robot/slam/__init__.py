"""Simultaneous localization and mapping: a robot's pose and map from its odometry and laser.

``particle_filter.py`` has the steps of a scan, ``kernels/`` the loops of each step. The same filter
serves the simulator (the plug-ins ``desim/robot/localization/kinds/gmapping.py`` and
``scan_matching.py``) and logs of real robots (``desim/imports/slam_logs``).
"""
