"""A run while it goes on: what viewers see of it over the network."""
