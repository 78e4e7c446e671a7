"""Verification of stepload: fault campaign, the paper's numbers, emulated devices."""
