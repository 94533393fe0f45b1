"""DDS, the middleware of ROS 2: participants that find each other, reliable and best-effort data.

The plug-in is ``desim.middleware.dds.dds:Dds``.
"""
