#version 330 core
// The picture in a window, over a plain background, with the light's marker: a glowing disc, or a dim ring if the light
// is behind the object. It is turned over, because the first row of a window is at the bottom.

uniform sampler2D picture;
uniform vec4 marker;  // place in pixels of the picture, radius in pixels (0: none), 1 if behind
uniform vec3 marker_color;

out vec4 color;

const vec3 UPPER = vec3(0.165, 0.173, 0.188);
const float GLOW = 6.0;  // how far the marker shines, in its radii
const vec3 LOWER = vec3(0.086, 0.090, 0.102);

void main() {
    ivec2 size = textureSize(picture, 0);
    vec2 pixel = vec2(gl_FragCoord.x, float(size.y) - gl_FragCoord.y) - 0.5;
    vec4 seen = texelFetch(picture, clamp(ivec2(pixel + 0.5), ivec2(0), size - 1), 0);
    vec3 result = mix(mix(UPPER, LOWER, pixel.y / float(size.y)), seen.rgb, seen.a);
    float away = marker.z > 0.0 ? distance(pixel, marker.xy) / marker.z : 9.0;
    if (away < GLOW) {
        float edge = 0.7 / marker.z;
        float disc = 1.0 - smoothstep(1.0 - edge, 1.0 + edge, away);
        float ring = disc * smoothstep(0.72 - edge, 0.72 + edge, away);
        float outline = 1.0 - smoothstep(1.2 - edge, 1.2 + edge, away);
        float fade = 1.0 - away / GLOW;
        bool behind = marker.w > 0.5;
        result += (behind ? 0.1 : 0.45) * fade * fade * fade * marker_color;
        result = mix(result, vec3(0.0), 0.4 * outline);
        result = mix(result, marker_color, behind ? 0.7 * ring : disc);
    }
    color = vec4(result, 1.0);
}
