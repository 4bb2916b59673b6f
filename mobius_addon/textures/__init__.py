"""Pictures of the source's materials, carried to the target's UV layout, texel by texel."""
