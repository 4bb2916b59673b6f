"""What comes out: the alignment, how sure each point of it is, what is left out of it, and the whole it is of."""
