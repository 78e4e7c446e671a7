"""What the data of a run can bear: well-posed stiffnesses, the laws that fit, and the gates.

A law is an assumption; the data are not. Stiffnesses are read where they need the least of it,
several laws are held against each other, and what a second cycle, a hold or a side force tells
against an elastic contact is looked at before a number is called identified.
"""
