"""Where a map is in doubt: what else it might be, and which of several is taken."""
