#include "common/splat_corners.glsl"
#include "common/toksvig.glsl"

// Calm normals, for light: what noise leaves in normals is seen as stains. The photograph and the depth say where surfaces
// end; between, normals are averaged over cells of 4x4 pixels and over more and more distant cells (edge-avoiding
// wavelets: Dammertz et al. 2010), each by how sure it is. Normals that vary evenly stay, as on spheres and cylinders.

const int SIDE = 4;               // pixels of a cell
const float PHOTO = 0.08;         // difference of the photograph's log luminance that makes a neighbour count 1/e
const float CHROMA = 0.9;         // of differences of red and blue from green, over brightness, beside that
const float SLACK = 0.6;          // times the noise of depth, by which a surface may miss a point
const float STEEPEST_TILT = 0.5;  // radians of noise that are believed
const float LEAST_TILT = 0.004;   // radians of noise that every normal has
const float COMPLETED_TILT = 0.35;  // radians: of normals that nobody measured
const float OUTLIER = 3.0;        // standard deviations from the others, from which on a normal counts less
const float FAR_OUTLIER = 7.0;    // from a pixel's own normal: noise is underrated, but such a difference is a shape
const float FLAT_OUTLIER = 1.2;   // from its own normal, where the photograph says nothing
const int OWN_STRIDE = 2;         // cells: from there on a normal is held against the cell's own, no longer against the mean
const float SURER = 0.12;         // of its own tilt: neighbours count as no surer than that, or a strange one decides
const float RIDGE = 0.05;         // of the places' variance: few places have no slope
const float DARK = 0.08;          // brightness below which the photograph tells little
const float BELIEF = 3.5;         // times their tilts, by which normals scatter where depth is right
const float UNSURE = 0.05;        // tilt from which on any scatter is possible
const float LEAST_SCATTER = 0.08; // radians, which are no sign that depth is wrong; these two
const float SCATTER = 0.2;        // and which are one
const float LIKE = 0.3;           // difference of colour, as PHOTO, of what may be one surface
const int BEHIND = 3;             // cells: so near to the edge of something nearer,
const float STEP = 0.06;          // by this share of the depth,
const float BEHIND_TILT = 0.22;   // radians: cameras that match windows widen it, and normals are no surer than that
const float LEAST_LIKE = 11.0;    // cells of 25 that are: fewer are no wide area
const float UNSUREST = 0.6;       // radians of noise, the most of a single pixel
const float LEAST_WRONG = 0.65;   // radians: from these on depth is wrong,
const float WRONG_TILT = 0.7;     // radians: where it surely is
const float SOME_TILT = 0.4;      // radians: where some of what looks alike is
const float WRONG_PHOTO = 0.3;    // as PHOTO, there
const float MOST_UNLIKE = 4.0;    // of these: where nobody alike is sure, all around say more
const float LOST = 0.3;           // radians: surfaces that are both less sure are not told apart by depth
const float MIXED = 20.0;         // times the variance of normals that a cell's surroundings leave makes highlights dim, beyond
const float EVEN = 0.01;          // radians squared: what small round bodies leave
const float NEAR = 0.05;          // of the depth: cells farther off are another surface
const float BLACK = -5.1;         // luminance of the photograph, below which
const float BURNT = 0.165;        // and above which all look alike: that is no plain surface

// What a pixel, or a cell of pixels, knows of its surface.
struct Facet {
    vec3 point;       // camera axes; depth 0: nothing
    vec3 normal;
    vec3 color;       // of the photograph: log luminance, chroma
    float tilt;       // standard deviation of the normal, radians
    bool is_blind;    // is the photograph the same all around, without any noise? then it is no witness
};

// surface_map: normal and depth; witness_map: luminance, tilt (negative where it is blind) and chroma. Pixels `side` apart.
Facet facet_at(sampler2D surface_map, sampler2D witness_map, ivec2 place, float side, vec4 intrinsics) {
    ivec2 inside = clamp(place, ivec2(0), textureSize(surface_map, 0) - 1);
    vec4 surface = inside == place ? surface_at(surface_map, inside) : vec4(0.0);
    vec4 seen = texel_at(witness_map, inside);
    vec2 pixel = side * vec2(place) + 0.5 * (side - 1.0);
    return Facet(pixel_ray(pixel, intrinsics) * surface.w, surface.xyz, seen.xzw, abs(seen.y), seen.y < 0.0);
}

bool is_facet(Facet facet) {
    return facet.point.z > 0.0 && facet.normal != vec3(0.0);
}

// Does it lie in a wide area whose depth is wrong? Then only the photograph tells which surface it belongs to.
bool is_wrong(Facet facet) {
    return facet.tilt > LEAST_WRONG;
}

// By how many standard deviations, squared and halved, does another facet miss the own surface? noise: of depth, over depth
float strangeness(Facet own, Facet other, float noise, vec4 intrinsics) {
    vec3 way = other.point - own.point;
    float off = min(abs(dot(way, own.normal)), abs(dot(way, other.normal)));
    float tilt = min(own.tilt + other.tilt, STEEPEST_TILT);
    float slack = (SLACK * noise + 0.5 / mean_focal_length(intrinsics)) * own.point.z + tilt * length(way);
    bool is_any = is_wrong(own) || is_wrong(other);
    off = min(own.tilt, other.tilt) > LOST || is_any ? 0.0 : off / slack;
    float unlike = length(other.color - own.color);
    return 0.5 * off * off + (is_any ? min(unlike / WRONG_PHOTO, MOST_UNLIKE) : unlike / PHOTO);
}

// The logarithm of the photograph's brightness (x), the tilt of the normal (y), and chroma.
vec4 witness_of(vec3 color, float certainty, bool is_measured) {
    float brightness = sqrt(dot(color * color, vec3(0.2126, 0.7152, 0.0722)));  // of the eye: near the power of sRGB
    float tilt = sqrt((1.0 / max(certainty, 0.05) - 1.0) / WANDERING);  // see normal_certainty.frag
    tilt = clamp(tilt, is_measured ? LEAST_TILT : COMPLETED_TILT, UNSUREST);
    return vec4(2.5 * log(brightness + DARK), tilt, CHROMA / (brightness + DARK) * (color.rb - color.g));
}

// Of the pixels of a cell: the surest of the four in its middle, or else the last one, and those that belong to it.
// normal, depth in the cell's middle
vec4 join_facets(
    sampler2D surface_map, sampler2D witness_map, ivec2 cell, float noise, vec4 intrinsics, out vec4 joined
) {
    Facet own = Facet(vec3(0.0), vec3(0.0), vec3(0.0), 1e30, true);
    for (int k = 0; k < 4; ++k) {
        ivec2 pixel = SIDE * cell + SIDE / 2 - ivec2(k % 2, k / 2);
        Facet facet = facet_at(surface_map, witness_map, pixel, 1.0, intrinsics);
        if (is_facet(facet) && facet.tilt < own.tilt) own = facet;
    }
    for (int k = 0; k < SIDE * SIDE && !is_facet(own); ++k) {
        own = facet_at(surface_map, witness_map, SIDE * cell + ivec2(k % SIDE, k / SIDE), 1.0, intrinsics);
    }
    float s = 0.0, darkest = 1e30, brightest = -1e30;
    vec3 normal = vec3(0.0), point = vec3(0.0), color = vec3(0.0);
    for (int k = 0; k < SIDE * SIDE; ++k) {
        Facet facet = facet_at(surface_map, witness_map, SIDE * cell + ivec2(k % SIDE, k / SIDE), 1.0, intrinsics);
        float m = is_facet(facet) ? exp(-strangeness(own, facet, noise, intrinsics)) / (facet.tilt * facet.tilt) : 0.0;
        darkest = min(darkest, facet.color.x);
        brightest = max(brightest, facet.color.x);
        s += m;
        normal += m * facet.normal;
        point += m * facet.point;
        color += m * facet.color;
    }
    bool is_plain = darkest == brightest && darkest > BLACK && brightest < BURNT;
    joined = vec4(color.x / s, is_plain ? -own.tilt : own.tilt, color.yz / s);
    if (!is_facet(own)) return vec4(0.0);
    vec3 ray = pixel_ray(float(SIDE) * vec2(cell) + 0.5 * float(SIDE - 1), intrinsics);
    float depth = dot(normal, point / s) / dot(normal, ray);
    bool is_near = abs(depth * s / point.z - 1.0) < 0.1;
    return vec4(normalize(normal), is_near ? depth : point.z / s);
}

// Sums of which normals that vary evenly are found; at: of places.
struct Bend {
    float total;
    vec2 at;
    vec3 squares;  // xx, xy, yy
    vec3 normal, x_normal, y_normal;
};

const Bend NO_BEND = Bend(0.0, vec2(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));

void add_normal(inout Bend bend, vec2 at, float weight, vec3 normal) {
    bend.total += weight;
    bend.at += weight * at;
    bend.squares += weight * vec3(at.x * at.x, at.x * at.y, at.y * at.y);
    bend.normal += weight * normal;
    bend.x_normal += weight * at.x * normal;
    bend.y_normal += weight * at.y * normal;
}

// The variance of normals that an even bend leaves, of one axis; mean: their mean; here: what is expected at the middle
float variance_left(Bend bend, out vec3 mean, out vec3 here) {
    vec2 at = bend.at / bend.total;
    mean = bend.normal / bend.total;
    vec3 x = bend.x_normal / bend.total - at.x * mean, y = bend.y_normal / bend.total - at.y * mean;
    float xx = bend.squares.x / bend.total - at.x * at.x + RIDGE, yy = bend.squares.z / bend.total - at.y * at.y + RIDGE;
    float xy = bend.squares.y / bend.total - at.x * at.y;
    vec3 slope_x = (yy * x - xy * y) / (xx * yy - xy * xy), slope_y = (xx * y - xy * x) / (xx * yy - xy * xy);
    here = mean - at.x * slope_x - at.y * slope_y;
    return 0.5 * max(1.0 - dot(mean, mean) - dot(slope_x, x) - dot(slope_y, y), 0.0);
}

// From 0 to 1: do the normals of cells that look alike scatter? Neither an even bend nor noise does that.
float scatter_at(sampler2D surface_map, sampler2D witness_map, ivec2 cell) {
    vec3 color = texel_at(witness_map, cell).xzw;
    float noise = 0.0;
    ivec2 last = textureSize(surface_map, 0) - 1;
    Bend bend = NO_BEND;
    for (int k = 0; k < 9; ++k) {
        ivec2 off = ivec2(k % 3, k / 3) - 1, place = clamp(cell + 2 * off, ivec2(0), last);
        vec4 surface = texel_at(surface_map, place);
        vec4 seen = texel_at(witness_map, place);
        float far = 1.4 * float(off.x * off.x + off.y * off.y);
        float m = surface.w == 0.0 ? 0.0 : exp(-far - length(seen.xzw - color) * (1.0 / LIKE));
        add_normal(bend, vec2(off), m, surface.xyz);
        noise += m * min(seen.y * seen.y, UNSURE * UNSURE);
    }
    vec3 mean, here;
    if (texel_at(surface_map, cell).w == 0.0) return 0.0;
    float scatter = sqrt(min(variance_left(bend, mean, here), BELIEF * BELIEF * noise / bend.total));
    return clamp((scatter - LEAST_SCATTER) / (SCATTER - LEAST_SCATTER), 0.0, 1.0);
}

// From 0 to 1: is something nearer seen beside a cell, that its surface does not lead to? 1/z is linear on planes.
float behind_at(sampler2D surface_map, ivec2 cell) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    float own = texel_at(surface_map, cell).w, rise = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 off = BEHIND * (ivec2(k % 3, k / 3) - 1);
        float one = texel_at(surface_map, clamp(cell + off, ivec2(0), last)).w;
        float other = texel_at(surface_map, clamp(cell - off, ivec2(0), last)).w;
        rise = max(rise, (one > 0.0 ? own / one - 1.0 : 0.0) + (other > 0.0 ? own / other - 1.0 : 0.0));
    }
    return smoothstep(0.5 * STEP, STEP, rise);
}

// What a cell knows beside its surface. Where the photograph shows one surface and normals scatter, not along a line but over
// a wide area, depth is wrong: glass, reflections, and blank walls do that. Nothing there is sure, and little beside it or
// behind the edge of something nearer.
vec4 doubted_witness(sampler2D witness_map, sampler2D scatter_map, ivec2 cell) {
    vec4 own = texel_at(witness_map, cell);
    ivec2 last = textureSize(scatter_map, 0) - 1;
    float sum = 0.0, total = 0.0;
    for (int k = 0; k < 25; ++k) {
        ivec2 place = clamp(cell + 4 * (ivec2(k % 5, k / 5) - 2), ivec2(0), last);
        float m = exp(-length(texel_at(witness_map, place).xzw - own.xzw) * (1.0 / LIKE));
        sum += m * texel_at(scatter_map, place).r;
        total += m;
    }
    float share = sum / max(total, LEAST_LIKE), doubt = smoothstep(0.3, 0.5, share);
    doubt = max(doubt, smoothstep(0.1, 0.16, own.x));
    float tilt = max(abs(own.y), WRONG_TILT * doubt);
    float some = max(SOME_TILT * smoothstep(0.1, 0.3, share), BEHIND_TILT * texel_at(scatter_map, cell).g);
    return vec4(own.x, own.y < 0.0 ? -tilt : max(tilt, some), own.zw);
}

// The certainty of the normal of a cell, for highlights: less where depth is doubted or normals are mixed. Where unsure cells
// around differ by more than an even bend, as at creases and small parts, pixels between them get normals that no surface
// has, and glint; sure ones are not mixed. surface_map, witness_map: of calm cells; doubt_map: of calm_doubts.frag
float doubted_certainty(sampler2D surface_map, sampler2D witness_map, sampler2D doubt_map, ivec2 cell) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    vec4 own = texel_at(surface_map, cell);
    float left = texel_at(witness_map, cell).y, own_doubt = texel_at(doubt_map, cell).y, tilt = 0.0;
    Bend bend = NO_BEND;
    for (int k = 0; k < 9; ++k) {
        ivec2 off = ivec2(k % 3, k / 3) - 1, place = clamp(cell + off, ivec2(0), last);
        vec4 surface = texel_at(surface_map, place);
        vec3 miss = surface.xyz - own.xyz;
        float doubt = texel_at(doubt_map, place).y;
        float both = max(own_doubt * own_doubt + doubt * doubt, LEAST_TILT * LEAST_TILT);
        float far = 0.69 * float(off.x * off.x + off.y * off.y) + abs(surface.w - own.w) / (NEAR * own.w);
        far += 0.5 * dot(miss, miss) / (FAR_OUTLIER * FAR_OUTLIER * both);
        add_normal(bend, vec2(off), surface.w == 0.0 ? 0.0 : exp(-far), surface.xyz);
        tilt += abs(doubt) / 9.0;
    }
    if (own.w == 0.0) return 1.0;
    vec3 mean, here;
    float variance = WANDERING * left * left + MIXED * max(variance_left(bend, mean, here) - EVEN, 0.0);
    return normal_certainty(variance) * (1.0 - 0.99 * smoothstep(COMPLETED_TILT, WRONG_TILT, tilt));
}

// A cell among those around, `stride` apart: first the mean of those on its surface, then, without those that miss the
// mean, the value at its own place of what varies evenly. is_shared: do neighbours this near share their noise?
vec4 calm_facet(
    sampler2D surface_map, sampler2D witness_map, ivec2 cell, int stride, float noise, vec4 intrinsics, bool is_shared,
    out vec4 left
) {
    Facet own = facet_at(surface_map, witness_map, cell, float(SIDE), intrinsics);
    left = texel_at(witness_map, cell);
    if (!is_facet(own)) return vec4(0.0);
    float weights[9], tilts[9], total = 0.0;
    vec3 normals[9], mean = vec3(0.0);
    for (int k = 0; k < 9; ++k) {
        ivec2 off = ivec2(k % 3, k / 3) - 1;
        Facet other = facet_at(surface_map, witness_map, cell + stride * off, float(SIDE), intrinsics);
        float far = 0.69 * float(off.x * off.x + off.y * off.y);  // about 1 2 1
        float surest = own.tilt > LOST ? other.tilt : max(other.tilt, SURER * own.tilt);
        float m = exp(-far - strangeness(own, other, noise, intrinsics)) / (surest * surest);
        weights[k] = is_facet(other) ? m : 0.0;
        tilts[k] = other.tilt * other.tilt;
        normals[k] = other.normal;
        mean += weights[k] * other.normal;
        total += weights[k];
    }
    float outlier = own.is_blind ? FLAT_OUTLIER * FLAT_OUTLIER : OUTLIER * OUTLIER;
    bool is_own = own.is_blind || (stride >= OWN_STRIDE && own.tilt < LOST);  // what is small and sure, as a nose, stays
    float spread = is_own ? 0.0 : 0.5 * max(1.0 - dot(mean, mean) / (total * total), 0.0);
    vec3 expected = is_own ? own.normal : normalize(mean);
    float squares = 0.0, wrong = 0.0;
    Bend bend = NO_BEND;
    for (int k = 0; k < 9; ++k) {
        vec3 miss = normals[k] - expected;
        float m = weights[k] * exp(-0.5 * dot(miss, miss) / (outlier * (own.tilt * own.tilt + tilts[k]) + spread));
        add_normal(bend, vec2(k % 3, k / 3) - 1.0, m, normals[k]);
        bool is_noise = tilts[k] <= LEAST_WRONG * LEAST_WRONG;
        squares += is_noise ? m * m * tilts[k] : 0.0;
        wrong += is_noise ? 0.0 : m * sqrt(tilts[k]);
    }
    squares += wrong * wrong;  // noise becomes less in a mean; what is wrong together does not
    vec3 here;
    float rest = variance_left(bend, mean, here), s = bend.total;
    float variance = max(squares, rest * s * s / 9.0) / (s * s);  // they may miss the plane by more than their tilts say
    if (own.is_blind || !is_shared) left.y *= min(sqrt(variance) / own.tilt, 1.0);
    if (abs(left.y) < LEAST_TILT) left.y = sign(left.y) * LEAST_TILT;
    return vec4(normalize(length(here) > 0.1 ? here : mean), texel_at(surface_map, cell).w);
}

// The normal of a pixel: its own, and those of the four cells around. own_share: of what its variance says it counts;
// least_tilt: of the normal, where depth may be wrong; what is behind something shares cells with that
vec3 calm_normal(
    sampler2D surface_map, sampler2D witness_map, sampler2D other_map, sampler2D joined_map, ivec2 pixel, float noise,
    float own_share, float least_tilt, vec4 intrinsics
) {
    Facet own = facet_at(surface_map, witness_map, pixel, 1.0, intrinsics);
    own.tilt = max(own.tilt, least_tilt > LOST ? least_tilt : 0.0);
    vec2 at = (vec2(pixel) - 0.5 * float(SIDE - 1)) / float(SIDE);
    ivec2 low = ivec2(floor(at));
    vec2 share = at - vec2(low);
    vec3 sum = vec3(0.0);
    bool is_blind = texel_at(joined_map, pixel / SIDE).y < 0.0;
    float doubt = own.tilt * own.tilt, outlier = is_blind ? FLAT_OUTLIER * FLAT_OUTLIER : FAR_OUTLIER * FAR_OUTLIER;
    for (int k = 0; k < 4; ++k) {
        ivec2 off = ivec2(k % 2, k / 2);
        Facet cell = facet_at(other_map, joined_map, low + off, float(SIDE), intrinsics);
        vec2 near = mix(1.0 - share, share, vec2(off));
        vec3 miss = cell.normal - own.normal;
        float variance = cell.tilt * cell.tilt;
        float strange = strangeness(own, cell, noise, intrinsics) + 0.5 * dot(miss, miss) / (outlier * (doubt + variance));
        float m = near.x * near.y * exp(-strange) / variance;
        sum += is_facet(cell) ? m * cell.normal : vec3(0.0);
    }
    sum = max(doubt - LEAST_TILT * LEAST_TILT, 0.0) * sum + (is_blind ? 1.0 : own_share) * own.normal;
    return is_facet(own) ? normalize(sum) : own.normal;
}
