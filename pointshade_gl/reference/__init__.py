"""The CPU mirror: every function of shaders/common once more in NumPy, same name, same order of arguments.

It is the truth that the GPU is held to, in float32 and the same order of operations, and never part of a picture
that a user gets. A vec3 is an array (..., 3), a sampler an array (h, w, ...), a mat4 an array (4, 4) by rows.
"""
