"""What suits scans of one kind of object: the defaults."""

import bpy

settings = bpy.context.scene.mobius

settings.reflect = "auto"
settings.refine = "dense"
settings.parts = "all"
settings.samples = 100
settings.targets = 1000
settings.radius = 0.0
settings.z_max = 0.8337
