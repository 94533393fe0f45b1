"""The replay page: one HTML file in which the robots of a run move and their network lives."""
