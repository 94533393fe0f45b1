"""Comparisons of desim's middlewares with measurements of the real software.

``desim validate --only middleware`` runs them. Each file is a family. Its ``checks()`` runs the
hosts of ``laboratory.py`` and compares the outcome with measurements on real hosts. The group
``middleware`` lists the families.
"""
