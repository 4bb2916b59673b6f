"""Surfaces too deep for one disc: cut at their necks, and put together again."""
