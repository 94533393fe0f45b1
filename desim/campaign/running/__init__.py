"""The running of a campaign: which run is next, and the processes or the cluster that make it."""
