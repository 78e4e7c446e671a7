"""What proves stepload: fault campaign, the paper's numbers, emulated devices."""
