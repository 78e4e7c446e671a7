"""A record read by independent readers."""
