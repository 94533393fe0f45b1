"""Networks without robots: standard cases, and the load of a whole fleet."""
