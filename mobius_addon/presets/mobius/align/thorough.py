"""Twice as many points on both surfaces."""

import bpy

settings = bpy.context.scene.mobius

settings.reflect = "auto"
settings.refine = "dense"
settings.parts = "all"
settings.samples = 200
settings.targets = 2000
settings.radius = 0.0
settings.z_max = 0.8337
