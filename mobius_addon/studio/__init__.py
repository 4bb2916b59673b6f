"""Where pictures are made: a scene of its own, rendered by Cycles and gone afterwards, and what stands in it."""
