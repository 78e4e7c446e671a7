"""Conclusions that the data of a run support: stiffnesses, the laws that fit, and the doubts.

A law is an assumption; the data are not. Stiffnesses are read where they depend least on a law,
several laws are compared, and signs of an inelastic contact in a second cycle, a hold or the
lateral force are checked before a number is called identified.
"""
