"""Changes: asked for, allowed, made at several nodes or at none, seen in messages, remembered and taken back."""
