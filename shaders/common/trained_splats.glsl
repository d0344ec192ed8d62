// Trained splats: how they cover each other, the surface on which they lie, and the shadows that they cast.

const float MOST_OPAQUE = 0.99;   // as trained
const float PIXEL_BLUR = 0.3;     // pixels squared: what the training adds to each ellipse
const float NEAREST_PAST = 1.0;  // thicknesses behind a surface where its shadow begins, and where it is full
const float SURELY_PAST = 3.5;
const float RIDGE = 1e-6;        // keeps a fit to too few pixels solvable
const float APART = 3.0;          // thicknesses of a surface of splats: what lies farther apart are two surfaces

// What a splat covers of a pixel. square: of how many deviations it lies from the middle
float splat_alpha(float opacity, float square) {
    return min(MOST_OPAQUE, opacity * exp(-0.5 * square));
}

// How many times smaller a splat of this area, squared pixels, is made that stands for a surface. A surface ends halfway
// out of the splats on its rim, which are as wide as they need be to cover its middle. The blur of pixels stays.
float density(float area, float most) {
    return area / (max(area - PIXEL_BLUR, 0.0) / most + PIXEL_BLUR);
}

// The opacity with which so much less area takes as much light in all.
float dense_opacity(float opacity, float denser) {
    return 1.0 - pow(1.0 - min(opacity, MOST_OPAQUE), denser);
}

// The two depths, the nearer first, of which one pixel shows a mixture, and the share of the nearer: they have the mean,
// the variance and the skewness of what was blended. sums: of depths, their squares and cubes, and of the weights
vec3 two_depths(vec4 sums) {
    vec3 means = sums.xyz / sums.w;
    float variance = max(means.y - means.x * means.x, 0.0);
    float deviation = sqrt(variance);
    if (deviation < 1e-6) return vec3(means.xx, 1.0);
    float skewness = (means.z - 3.0 * means.x * variance - means.x * means.x * means.x) / (variance * deviation);
    float half_skew = 0.5 * skewness, root = sqrt(1.0 + half_skew * half_skew);
    vec2 ends = half_skew + vec2(-root, root);
    return vec3(means.x + deviation * ends, ends.y / (ends.y - ends.x));
}

// Share of light that reaches a depth past splats. seen: the two depths in the light's view, what the nearer hides, and
// what both hide together; thickness: of a surface of splats
float share_past_splats(vec4 seen, float depth, float thickness) {
    vec2 past = clamp(((depth - seen.xy) / thickness - NEAREST_PAST) / (SURELY_PAST - NEAREST_PAST), 0.0, 1.0);
    float hidden = past.x * seen.z + past.y * (seen.w - seen.z);
    hidden *= hidden;  // the rim of a surface of splats is fuzzy, and wider than what it stands for
    return 1.0 - hidden * hidden;
}

// The plane through points whose inverse depths are a + b x + c y, pixels aside: its unit normal towards the viewer.
// first, second: sums of the weights times 1, x, y and times xx, xy, yy; right: times the inverse depths times 1, x, y
vec3 fitted_normal(vec3 first, vec3 second, vec3 right, vec2 ray, vec2 focal) {
    mat3 squares = mat3(first, first.y, second.xy, first.z, second.yz) + mat3(RIDGE);
    vec3 plane = inverse(squares) * right;
    vec2 aside = plane.yz * focal;
    return -normalize(vec3(aside, plane.x - dot(aside, ray)));
}
