#version 330 core
// The triangles between the pixels of a frame in a light's view: only their depth counts.
void main() {}
