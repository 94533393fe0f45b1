"""Loops of SLAM: points of scans, tiles of maps, and the alignment of one with the other."""
