"""What all passes are made of: images, textures, programs, memory, and steps that run only when their inputs change."""
