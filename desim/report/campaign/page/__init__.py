"""The page of a report as HTML: its elements, its style, its captions."""
