"""Drivers that come with stepload; found through entry points, none is imported by it."""
