"""The state machine of the DCF, compiled."""
