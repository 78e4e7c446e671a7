"""Explanations of the codes that stepload prints or writes."""
