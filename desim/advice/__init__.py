"""Advice about scenarios and runs: what their author may not have meant."""
