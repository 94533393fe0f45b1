"""A run put together: its hosts, its network, its world and its clock."""
