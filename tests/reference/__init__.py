"""The CPU mirror: every function of shaders/common once more in NumPy, with the same name and order of arguments.

Tests compare the GPU with it. It computes in float32 and in the same order of operations, and takes no part in the
pictures that users get. A vec3 is an array (..., 3), a sampler an array (h, w, ...), a mat4 an array (4, 4) by rows.
"""
