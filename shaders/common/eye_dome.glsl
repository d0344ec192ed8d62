// Eye-dome lighting: surfaces are darker beside what is nearer, so that depth is seen without light. Boucheny 2009;
// Ribes, Boucheny 2011.
#include "common/texels.glsl"

const float EYE_DOME_REACH = 1.4 / 480.0;  // how far neighbours are, in heights of the picture: all sizes look alike
const float EYE_DOME_STRENGTH = 8.0;       // for each neighbour, and each time that it is nearer by half
const float EYE_DOME_NEAREST = 1.06;       // times nearer: what is more counts as this, so that edges keep some colour

// How far the neighbours are, pixels: at least those next to the pixel.
float eye_dome_reach(float height) {
    return max(EYE_DOME_REACH * height, 1.0);
}

// How many times nearer a neighbour at depth `other` is than a surface at depth z; 1 if it is not, or is nothing.
float eye_dome_step(float z, float other) {
    return other == 0.0 ? 1.0 : clamp(z / abs(other), 1.0, EYE_DOME_NEAREST);
}

// The share of its light that a pixel keeps between its eight neighbours. z: its depth; surface_map: depth in w, 0 is
// nothing. It depends on the logarithms of depth, so it is the same at any distance; that of a product is their sum.
float eye_dome(sampler2D surface_map, ivec2 pixel, float z) {
    float reach = eye_dome_reach(float(textureSize(surface_map, 0).y));
    int straight = int(floor(reach + 0.5)), aslant = int(floor(reach * sqrt(0.5) + 0.5));
    float steps = 1.0;
    for (int k = 0; k < 9; ++k) {
        ivec2 side = ivec2(k % 3, k / 3) - 1;
        ivec2 offset = side * (side.x * side.y == 0 ? straight : aslant);
        if (side != ivec2(0)) steps *= eye_dome_step(z, texel_or_zero(surface_map, pixel + offset).w);
    }
    return exp(-EYE_DOME_STRENGTH * log2(steps));
}
