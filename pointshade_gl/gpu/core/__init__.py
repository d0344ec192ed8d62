"""What all passes are made of: images, textures, programs, memory, steps."""
