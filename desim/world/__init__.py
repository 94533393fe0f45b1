"""Matter: terrain, bodies, sensors and contacts."""
