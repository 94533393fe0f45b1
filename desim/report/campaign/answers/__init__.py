"""The answers of a report, one file per question, with their warnings and methods."""
