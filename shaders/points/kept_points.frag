#version 330 core
// Which point is seen inside of surfaces, as it was noted in the same view, not moved.

uniform sampler2D insides;
uniform isampler2D kept_ids;
uniform sampler2D kept_depths;

out int source_id;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(insides, pixel, 0).r == 0.0) discard;
    source_id = texelFetch(kept_ids, pixel, 0).r;
    gl_FragDepth = texelFetch(kept_depths, pixel, 0).r;
}
