"""Rates of map sharing: of complete updates, and of the merging of received updates."""

# Periods after which a robot sends all its evidence even if nothing has changed, for peers that
# missed a part or started again. Otherwise it sends nothing without a change (gmapping publishes
# only after a processed scan).
# (20 % less or more changes no run of scenarios/maze_8.yaml, where no message is lost.)
REFRESH_PERIODS = 6
# multirobot_map_merge's merging_rate (map_merging's is 10 Hz). A fleet of 200 that exchanges maps
# every 5 s then merges ten updates at once instead of one by one.
MERGING_HZ = 4
