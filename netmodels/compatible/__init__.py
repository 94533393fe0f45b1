"""The networks of other robot simulators, as their sources and manuals describe them."""
