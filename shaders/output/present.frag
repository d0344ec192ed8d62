#version 330 core
// The picture in a window, over a plain background, smoothly enlarged where it is coarser than that. It is turned over,
// because the first row of a window is at the bottom.

uniform sampler2D picture;
uniform vec2 size;  // of the window, pixels

out vec4 color;

const vec3 UPPER = vec3(0.165, 0.173, 0.188);
const vec3 LOWER = vec3(0.086, 0.090, 0.102);

vec4 texel_of(ivec2 place) {
    vec4 texel = texelFetch(picture, clamp(place, ivec2(0), textureSize(picture, 0) - 1), 0);
    return vec4(texel.rgb * texel.a, texel.a);
}

void main() {
    vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - 0.5;
    vec2 at = (pixel + 0.5) * vec2(textureSize(picture, 0)) / size - 0.5, share = fract(at);
    ivec2 low = ivec2(floor(at));
    vec4 seen = texel_of(low);
    if (share != vec2(0.0)) {
        vec4 below = mix(texel_of(low + ivec2(0, 1)), texel_of(low + 1), share.x);
        seen = mix(mix(seen, texel_of(low + ivec2(1, 0)), share.x), below, share.y);
    }
    color = vec4(mix(UPPER, LOWER, pixel.y / size.y) * (1.0 - seen.a) + seen.rgb, 1.0);
}
