"""What several test files share: nodes in processes of their own, a hand in RViz, random expressions and messages."""
