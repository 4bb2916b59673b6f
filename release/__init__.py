"""What makes the zips that people install: `python . build`. No part of them itself."""
