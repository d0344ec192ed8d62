"""From depth to surfaces: positions, normals, smoothing, upsampling, and the colours of a frame."""
