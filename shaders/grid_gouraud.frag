#version 330 core
// The triangles between the pixels of a frame, with the light of the pixels interpolated. Normal 0 says: already lit.
uniform mat4 view;
uniform float scale;
uniform float material_number;

in vec3 point;
in vec3 light;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;

void main() {
    surface = vec4(0.0, 0.0, 0.0, scale * (mat3(view) * point + view[3].xyz).z);
    albedo = vec4(light, material_number);
}
