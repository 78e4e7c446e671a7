"""A directed search for the worst that can happen to a payload, beside the dice of the campaign."""
