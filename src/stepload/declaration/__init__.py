"""How sections of a file and options of a driver are declared: one field each, with its unit."""
