"""The frozen, fully resolved description of one run: YAML in, typed values out."""
