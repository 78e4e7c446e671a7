"""Imperfect contacts: how much they bias a result, and how soon slips or lateral force are seen."""
