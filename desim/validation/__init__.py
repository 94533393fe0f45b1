"""Comparisons of desim's middlewares with the real software.

Those of the network models are in ``netmodels.validation``.

``desim validate --only middleware`` runs these, one file per section. A section's ``checks()`` runs
the hosts of ``laboratory.py`` and compares the outcome with measurements on real hosts. The group
``middleware`` lists the sections.
"""
