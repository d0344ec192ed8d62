#version 330 core
// The picture in a window, over a plain background. It is turned over, because the first row of a window is at the bottom.

uniform sampler2D picture;

out vec4 color;

const vec3 UPPER = vec3(0.165, 0.173, 0.188);
const vec3 LOWER = vec3(0.086, 0.090, 0.102);

void main() {
    ivec2 size = textureSize(picture, 0);
    vec2 pixel = vec2(gl_FragCoord.x, float(size.y) - gl_FragCoord.y) - 0.5;
    vec4 seen = texelFetch(picture, clamp(ivec2(pixel + 0.5), ivec2(0), size - 1), 0);
    color = vec4(mix(mix(UPPER, LOWER, pixel.y / float(size.y)), seen.rgb, seen.a), 1.0);
}
