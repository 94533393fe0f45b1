"""Real programs beside our models on the same networks: ``desim validate --real``."""
