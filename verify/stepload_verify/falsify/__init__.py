"""A directed search for the worst case of a payload, in addition to the random campaign."""
