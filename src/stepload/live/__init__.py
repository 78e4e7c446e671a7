"""A run while it is under way, as viewers see it over the network."""
