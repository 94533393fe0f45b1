"""The runs of a campaign by vector, and what is computed of them: means, contrasts, knees."""
