"""UDP sockets of hosts as Linux has them, and their buffers."""
