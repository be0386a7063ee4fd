"""Locations: what they are, where they stand in files, and what nodes report of them."""
