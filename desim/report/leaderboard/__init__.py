"""The leaderboard: results of reference designs, a table for each version, in a Markdown page."""
