"""Everything beside the main pair: which parts belong together, and what rides along."""
