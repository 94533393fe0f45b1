"""The answers of a report, a question a file, and the notes and methods that belong to them."""
