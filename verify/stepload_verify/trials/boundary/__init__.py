"""Contacts by boundary elements: `curves` reads what is stored."""
