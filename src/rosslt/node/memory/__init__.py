"""What a node keeps in its own memory of its locations' values, and when a change goes there."""
