#include "common/flat_cells.glsl"

// Planes under noise that neighbours share: lumps, ripples and bands of sensors. Through the samples of
// normals_adaptive.glsl they look like the surface. Wider windows tell them from it: what a plane leaves there has no
// shape across the window, is as much as on other planes of the frame, and the windows close by hold, too. Windows lie
// around the middles of cells, as in flat_cells.glsl. A plane is (x: depth at its origin, yz: slope of w = 1/z per
// pixel relative to w, w: see below). bumps: standard deviation of w about the planes of the frame.

const int FAR_REACH = 40;         // square of the distance from its middle that the widest window contains, cells
const int FAR_STRETCH = 2;        // distance of its samples over that of WIDE
const float FULL = 49.0;          // samples of a window, the middle one included
const float LATERAL = 0.8;        // pixels by which depths are displaced (Nguyen, Izadi, Lovell 2012)
const float TOLERANCE = 4.0;      // standard deviations that a sample may lie from its plane
const float SURE = 0.6;           // share of the tolerance from which on the plane counts by degrees
const float NOISIER = 1.8;        // times the noise of the frame that a window may have
const float AGREEING = 0.75;      // share of the known samples that must lie within the tolerance
const float SHAPED = 20.0;        // shape from which on a window is no plane; noise with lumps has 1 to 20
const int AROUND = 6;             // cells: as far as the widest window reaches
const float SPAN = 27.0;         // pixels from the middle to the samples that are farthest apart in WIDE
const int CLOSE = 3;              // cells: so far the windows vote
const float ELECTED = 0.25;       // share of the cells on a plane whose own windows must hold
const float CALM = 2.3;           // times the noise of the frame that the middles of the cells may deviate
const float FEWEST_VOTES = 3.5;
const float UNKNOWN = -1.0;

// Place of a sample of a window; the last one is the middle.
vec2 window_place(int k, int stretch) {
    return k < 48 ? vec2(stretch * flat_offset(k, WIDE)) : vec2(0.0);
}

// Relative steps to the samples of a window around a pixel, and which samples are known (1, else 0).
void window_samples(sampler2D depth_map, ivec2 pixel, int stretch, out float d[49], out float m[49]) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    for (int k = 0; k < 49; ++k) {
        float there = depth_at(depth_map, pixel, ivec2(window_place(k, stretch)));
        m[k] = min(here, there) > 0.0 ? 1.0 : 0.0;
        d[k] = m[k] > 0.5 ? relative_step(here, there) : 0.0;
    }
}

// Plane through the samples with weight m: value at the pixel, slope per pixel.
vec3 window_plane(float d[49], float m[49], int stretch) {
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, sd = 0.0, sud = 0.0, svd = 0.0;
    for (int k = 0; k < 49; ++k) {
        vec2 place = window_place(k, stretch);
        float u = m[k] * place.x, v = m[k] * place.y;
        s += m[k];
        su += u;
        sv += v;
        suu += u * place.x;
        suv += u * place.y;
        svv += v * place.y;
        sd += m[k] * d[k];
        sud += u * d[k];
        svd += v * d[k];
    }
    return solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd);
}

// What a plane leaves of the samples with weight m: its variance (x), its shape (y), the number of samples (z). Shape
// is the mean square of a bowl, a saddle and a twist across the window, over that of the rest: 1 for white noise.
vec3 window_rest(float d[49], float m[49], vec3 plane, int stretch) {
    float wide = 0.0, s = 0.0, squares = 0.0;
    for (int k = 0; k < 49; ++k) {
        vec2 place = window_place(k, stretch);
        wide += dot(place, place) / FULL;
    }
    vec3 along = vec3(0.0), size = vec3(0.0);
    for (int k = 0; k < 49; ++k) {
        vec2 place = window_place(k, stretch);
        float rest = m[k] * (d[k] - (plane.x + plane.y * place.x + plane.z * place.y));
        vec3 shape = vec3(dot(place, place) - wide, place.x * place.x - place.y * place.y, place.x * place.y);
        s += m[k];
        squares += rest * rest;
        along += rest * shape;
        size += m[k] * shape * shape;
    }
    vec3 shaped = along * along / max(size, vec3(1e-6));
    float total = shaped.x + shaped.y + shaped.z;
    float other = max(squares - total, 1e-30) / max(s - 6.0, 1.0);
    return vec3(squares / max(s - 3.0, 1.0), total / (3.0 * other), s);
}

// What the window around a pixel leaves, to measure the bumps. x: standard deviation of w, UNKNOWN where samples are
// missing; y: that of the widest window; z: shape; w: how much w changes per pixel.
vec4 window_bumps(sampler2D depth_map, ivec2 pixel) {
    float here = max(depth_at(depth_map, pixel, ivec2(0)), 1e-30);
    float d[49];
    float m[49];
    window_samples(depth_map, pixel, FAR_STRETCH, d, m);
    float far = sqrt(window_rest(d, m, window_plane(d, m, FAR_STRETCH), FAR_STRETCH).x) / here;
    window_samples(depth_map, pixel, 1, d, m);
    vec3 plane = window_plane(d, m, 1);
    vec3 rest = window_rest(d, m, plane, 1);
    float wide = rest.z > FULL - 9.0 ? sqrt(rest.x) / here : UNKNOWN;
    return vec4(wide, far, rest.y, length(plane.yz) / here);
}

// Standard deviation of w about a plane in this frame.
float plane_noise(vec3 plane, float bumps) {
    return length(vec2(bumps, LATERAL * length(plane.yz) / max(plane.x, 1e-30)));
}

// The plane of the window around a pixel. w: standard deviation of w about it, negative if the window is the widest; 0
// for no plane.
vec4 bumpy_window(sampler2D depth_map, ivec2 pixel, int stretch, float bumps) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    float d[49];
    float known[49];
    float m[49];
    window_samples(depth_map, pixel, stretch, d, known);
    float total = 0.0, noise = 0.0;
    for (int k = 0; k < 49; ++k) total += known[k];
    if (total < KNOWN_SAMPLES) return vec4(0.0);
    vec3 plane = window_plane(d, known, stretch);
    for (int again = 0; again < 2; ++again) {
        noise = plane_noise(vec3(here, plane.yz), bumps) * here;
        for (int k = 0; k < 49; ++k) {
            vec2 place = window_place(k, stretch);
            float miss = d[k] - (plane.x + plane.y * place.x + plane.z * place.y);
            m[k] = abs(miss) < TOLERANCE * noise ? known[k] : 0.0;
        }
        plane = window_plane(d, m, stretch);
    }
    vec3 rest = window_rest(d, m, plane, stretch);
    bool holds = rest.x < NOISIER * NOISIER * noise * noise && rest.y < SHAPED && rest.z > AGREEING * total;
    float deviation = max(sqrt(rest.x), noise) / here;
    vec3 found = vec3(here, plane.yz) / max(1.0 + plane.x, LEAST);
    return holds ? vec4(found, stretch > 1 ? -deviation : deviation) : vec4(0.0);
}

// The plane of the widest window around a pixel.
vec4 widest_bumpy_window(sampler2D depth_map, ivec2 pixel, float bumps) {
    vec4 plane = bumpy_window(depth_map, pixel, FAR_STRETCH, bumps);
    return plane.w == 0.0 ? bumpy_window(depth_map, pixel, 1, bumps) : plane;
}

// By how much w of a depth misses that of a plane, over the tolerance.
float plane_miss(float plane_depth, float there, float deviation) {
    float least = max(min(plane_depth, there), 1e-30);
    return abs(there - plane_depth) / (least * max(plane_depth, there) * TOLERANCE * deviation);
}

// The plane of the window around another cell, at a cell's middle of this depth, and how much it counts (`weight`; 0 if
// the window does not contain the middle). w: deviation.
vec4 lent_plane(sampler2D planes, ivec2 cell, ivec2 away, float here, out float weight) {
    ivec2 last = textureSize(planes, 0) - 1, place = cell + away;
    vec4 plane = texelFetch(planes, clamp(place, ivec2(0), last), 0);
    int square = max(away.x * away.x + away.y * away.y, 1), reach = plane.w < 0.0 ? FAR_REACH : WIDE_REACH;
    vec4 lent = vec4(move_plane(plane.xyz, vec2(-FLAT_CELL * away)), abs(plane.w));
    bool reaches = plane.w != 0.0 && square <= reach && place == clamp(place, ivec2(0), last);
    float miss = reaches && here > 0.0 ? plane_miss(lent.x, here, lent.w) : 1.0;
    float close = max(1.0 - miss, 0.0);
    weight = float(reach * reach) / float(square) * close * close;
    return lent;
}

// The plane of a cell: the mean of the planes of all windows that contain its middle and agree with the best of them,
// if enough windows close by hold, and the middles of the cells close by deviate no more than noise. w: standard
// deviation of w about it, 0 for no plane, UNKNOWN where nothing is known.
vec4 bumpy_plane(sampler2D planes, sampler2D depth_map, ivec2 cell, ivec2 first, float bumps) {
    const int side = 2 * AROUND + 1, close = 2 * CLOSE + 1;
    float here = depth_at(depth_map, flat_middle(cell, first), ivec2(0)), total = 0.0, asked = 0.0;
    float votes = 0.0, squares = 0.0;
    if (!(here > 0.0)) return vec4(0.0, 0.0, 0.0, UNKNOWN);
    float weight, most = 0.0;
    vec4 best = vec4(0.0), sum = vec4(0.0);
    for (int k = 0; k < side * side; ++k) {
        vec4 lent = lent_plane(planes, cell, ivec2(k % side, k / side) - AROUND, here, weight);
        best = weight > most ? lent : best;
        most = max(weight, most);
    }
    if (!(most > 0.0)) return vec4(0.0);
    for (int k = 0; k < side * side; ++k) {
        vec4 lent = lent_plane(planes, cell, ivec2(k % side, k / side) - AROUND, here, weight);
        bool agrees = length(lent.yz - best.yz) * SPAN < TOLERANCE * best.w * best.x;
        sum += agrees ? weight * lent : vec4(0.0);
        total += agrees ? weight : 0.0;
    }
    vec4 mean = sum / total;
    ivec2 last = textureSize(planes, 0) - 1;
    for (int k = 0; k < close * close; ++k) {
        ivec2 away = ivec2(k % close, k / close) - CLOSE, place = cell + away;
        bool inside = place == clamp(place, ivec2(0), last);
        float there = depth_at(depth_map, flat_middle(place, first), ivec2(0));
        float expected = move_plane(mean.xyz, vec2(FLAT_CELL * away)).x;
        float miss = inside && there > 0.0 ? plane_miss(expected, there, mean.w) : 1.0;
        bool on_it = miss < 1.0;
        squares += on_it ? miss * miss : 0.0;
        asked += on_it ? 1.0 : 0.0;
        votes += on_it && texelFetch(planes, clamp(place, ivec2(0), last), 0).w != 0.0 ? 1.0 : 0.0;
    }
    float deviation = TOLERANCE * mean.w * sqrt(squares / max(asked, 1.0));
    bool holds = deviation < CALM * plane_noise(mean.xyz, bumps) && votes > max(ELECTED * asked, FEWEST_VOTES);
    return holds ? mean : vec4(0.0);
}

// The plane at a pixel, between those of the four cells around it. w: its share of the surface, 0 to 1. Cells of which
// nothing is known and planes that are another surface's do not count.
vec4 bumpy_surface(sampler2D planes, sampler2D depth_map, ivec2 pixel, ivec2 first) {
    float here = depth_at(depth_map, pixel, ivec2(0)), total = 0.0, held = 0.0, all = 0.0;
    ivec2 low = ivec2((vec2(pixel - first) + 0.5) / float(FLAT_CELL));  // integers are slow to divide
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 cell = low + ivec2(k % 2, k / 2);
        vec4 plane = texelFetch(planes, cell, 0);
        vec2 away = vec2(pixel - flat_middle(cell, first));
        vec2 near = max(1.0 - abs(away) / float(FLAT_CELL), 0.01);
        vec3 moved = move_plane(plane.xyz, away);
        float close = plane.w > 0.0 && here > 0.0 ? max(1.0 - plane_miss(moved.x, here, plane.w), 0.0) : 0.0;
        float sure = min(close / (1.0 - SURE), 1.0);
        float weight = near.x * near.y * close * close;
        sum += weight * moved;
        total += weight;
        held += near.x * near.y * sure;
        all += sure > 0.0 || plane.w == 0.0 ? near.x * near.y : 0.0;
    }
    return total > 0.0 ? vec4(sum / total, min(held / all, 1.0)) : vec4(0.0);
}

// Whether the four neighbours of a pixel lie on its plane, too. Then it is no rim. The picture's border does not count.
bool is_bumpy_plane(sampler2D depth_map, ivec2 pixel, vec3 plane, float bumps) {
    const ivec2 beside[4] = ivec2[4](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));
    ivec2 last = textureSize(depth_map, 0) - 1;
    bool on_plane = true;
    for (int k = 0; k < 4; ++k) {
        ivec2 offset = clamp(pixel + beside[k], ivec2(0), last) - pixel;
        float there = depth_at(depth_map, pixel, offset);
        float expected = move_plane(plane, vec2(offset)).x;
        on_plane = on_plane && there > 0.0 && plane_miss(expected, there, plane_noise(plane, bumps)) < 1.0;
    }
    return on_plane;
}
