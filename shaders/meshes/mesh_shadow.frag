#version 330 core
// A mesh in a light's view: only its depth counts.
in vec3 target_normal;
in vec2 texture_uv;
in vec3 corner_tint;
in float depth;

void main() {}
