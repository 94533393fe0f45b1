"""Statistics of a campaign: pure functions of arrays with one value a run.

Nothing is imported here, so that the import of one module costs one module.
"""
