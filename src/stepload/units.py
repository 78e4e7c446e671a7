"""Physical quantities written as text ("28.7 mm"): number and unit in, SI float out."""
