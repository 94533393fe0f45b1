"""From a goal to a velocity: costmaps, planners, and recovery (ROS's move_base).

Constants without a published source are tuned. ``maze_8: 191, 164 s`` beside one is the mean
exploration time of scenarios/maze_8.yaml, seeds 1 to 8, with the constant 20 % lower and 20 %
higher. Unchanged, the mean is 192 s with a standard error of 11 s: a difference below 30 s means
little. ``maze_8: same`` means that no run changed: the constant is for situations that this maze
does not have.
"""
