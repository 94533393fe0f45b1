"""Standard network cases without robots, one a file. ``desim net`` plays them."""
