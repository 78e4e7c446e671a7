"""A record in the hands of readers that nobody here wrote."""
