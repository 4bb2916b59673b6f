"""From the search to a map of every point: refined, on pieces, bent."""
