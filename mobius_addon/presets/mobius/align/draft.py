"""Quick and without bending, to see whether two surfaces match at all."""

import bpy

settings = bpy.context.scene.mobius

settings.reflect = "auto"
settings.refine = "mobius"
settings.parts = "all"
settings.samples = 60
settings.targets = 500
settings.radius = 0.0
settings.z_max = 0.8337
