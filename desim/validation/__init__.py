"""Middleware beside the real thing: ``desim validate --only middleware``. A family a file; each has
``checks()``, which plays the hosts of ``bench.py`` and compares what comes of it with what was
measured on real hosts. The group ``middleware`` lists the families.
"""
