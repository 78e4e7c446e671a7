"""Trials that take long and are run by hand: links, kills, soaks, coverage, whole plans by seed."""
