// How light that is stronger than white is shown: Khronos PBR Neutral (E. Lalish, Khronos Group, 2024). Up to BENDS_AT it
// only takes off the light that most materials reflect without a colour, so that pictures show their own colours.

const float COLORLESS = 0.04;  // reflected by a material with an index of refraction of 1.5
const float BENDS_AT = 0.76;   // above, the strongest channel approaches 1 along a hyperbola
const float FADES = 0.15;      // how fast colours become white there
const float BLINDING = 65504.0;

vec3 neutral_tone(vec3 light) {
    light = min(light, BLINDING);
    float least = min(light.r, min(light.g, light.b));
    vec3 color = light - (least < 2.0 * COLORLESS ? least - least * least / (4.0 * COLORLESS) : COLORLESS);
    float peak = max(color.r, max(color.g, color.b));
    if (peak <= BENDS_AT) return color;
    float rest = 1.0 - BENDS_AT;
    float shown = 1.0 - rest * rest / (peak + rest - BENDS_AT);
    return mix(vec3(shown), color * (shown / peak), 1.0 / (FADES * (peak - shown) + 1.0));
}
