"""The values in a node's memory that were computed from its locations, and how a change reaches them."""
