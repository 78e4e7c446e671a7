"""Curves of contacts by boundary elements: physics that shares nothing with the product's laws.

`make` solves them with tamaas and writes `curves.csv`; `curves` reads that file, without tamaas.
"""
