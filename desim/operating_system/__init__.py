"""Linux, macOS and Windows differ here; nothing else in desim asks which of them it is."""
