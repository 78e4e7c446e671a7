"""Contact theory: power law, roughness, plasticity, elastic limit.

Pure functions of numbers in SI units. Equation numbers are those of Verscheure, Sharf, Bruyninckx,
Swevers and De Schutter, "Identification of contact dynamics parameters for stiff robotic payloads".
"""
