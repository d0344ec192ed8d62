#version 330 core
// Planes of the frame before and how they differ, 128 where they do not -> planes.

uniform sampler2D before_map;
uniform sampler2D change_map;

out vec4 planes;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float change = texelFetch(change_map, pixel, 0).r - 128.0 / 255.0;
    planes = vec4(vec3(clamp(texelFetch(before_map, pixel, 0).r + change, 0.0, 1.0)), 1.0);
}
