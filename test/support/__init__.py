"""What several test files share: nodes in processes of their own, drags, random expressions and messages."""
