"""Comparisons of desim's middlewares with measurements of the real software.

``desim validate --only middleware``. A family a file; each has ``checks()``, which runs the
hosts of ``laboratory.py`` and compares the outcome with measurements on real hosts. The group
``middleware`` lists the families.
"""
