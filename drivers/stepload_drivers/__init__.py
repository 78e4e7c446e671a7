"""Drivers that come with stepload; each is found through its entry point, none is imported by it."""
