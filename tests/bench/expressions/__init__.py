"""Expressions carried from head to head, and how near they come to the target's own."""
