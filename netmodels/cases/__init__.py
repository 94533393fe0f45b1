"""Standard network cases without robots. ``desim net`` plays them."""
