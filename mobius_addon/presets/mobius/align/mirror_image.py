"""The target is the mirror image of the source, like a left and a right tooth."""

import bpy

settings = bpy.context.scene.mobius

settings.reflect = "always"
settings.refine = "dense"
settings.parts = "all"
settings.samples = 100
settings.targets = 1000
settings.radius = 0.0
settings.z_max = 0.8337
