#include "common/upsample_vote.glsl"

// Completes a surface where depth is missing: planes in 1/z are carried to a place from the points around it, and elected
// there. Colours, distance and what the sensor would have seen weigh the votes. Points are first joined in cells, each of
// which holds the two planes that most of its points lie on.
// Whoever includes this file defines CANDIDATES.

const int SIDE = 4;           // pixels along a side of a cell
const float AGREES = 0.02;    // planes that differ by less than this share of 1/z at a place agree there
const float DISTINCT = 0.3;   // of that: so near to one that stood for election, no other stands
const int ELECTIONS = 3;      // so many stand
const float MANY = 8.0;       // points of a cell from which on its plane has a whole vote
const float UNLIKE = 0.02;    // what other colours leave of a vote
const float UNPROVEN = 0.1;   // of that: what it leaves of a vote that only colours can prove
const float NEARER = 1.1;     // times the farthest 1/z: from which on a plane lies before others
const float UNSEEN = 0.05;    // what is left of it for a surface that the sensor would have seen

vec4 candidates[CANDIDATES];  // planes at the place: 1/z and its change per pixel; and their votes

// How often a loop runs that stands for an if: 1 for a share above 0. Compilers see no bound here, and so software drivers
// jump over what no pixel of a group needs.
int once_if(float share) {
    return int(ceil(share));
}

// Do planes agree where their 1/z are these?
bool agrees(float w, float other) {
    return abs(w - other) < AGREES * other;
}

// Sum of the candidates that agree on a 1/z, times their votes; the votes themselves in w.
vec4 supporters_of(float w) {
    vec4 sum = vec4(0.0);
    for (int k = 0; k < CANDIDATES; ++k) {
        sum += agrees(candidates[k].x, w) ? candidates[k].w * vec4(candidates[k].xyz, 1.0) : vec4(0.0);
    }
    return sum;
}

// The 1/z that most votes agree on: of the candidates with the most votes that are not near each other. 0 if there is none.
float elect() {
    float winner = 0.0, most = 0.0;
    vec3 stood = vec3(0.0);
    for (int turn = 0; turn < ELECTIONS; ++turn) {
        vec2 strongest = vec2(0.0);  // 1/z and votes
        for (int k = 0; k < CANDIDATES; ++k) {
            bool is_new = all(greaterThanEqual(abs(stood - candidates[k].x), DISTINCT * AGREES * stood));
            strongest = is_new && candidates[k].w > strongest.y ? candidates[k].xw : strongest;
        }
        float support = supporters_of(strongest.x).w;
        winner = support > most ? strongest.x : winner;
        most = max(support, most);
        stood = vec3(strongest.x, stood.xy);
    }
    return winner;
}

// The mean plane of those who agree on a 1/z, and their share of all votes; 0 if there is none.
vec4 elected(float w) {
    vec4 sum = supporters_of(w);
    float votes = 0.0;
    for (int k = 0; k < CANDIDATES; ++k) votes += candidates[k].w;
    return sum.w > 0.0 ? vec4(sum.xyz / sum.w, sum.w / votes) : vec4(0.0);
}

// Where the middle of a cell lies, pixels.
vec2 cell_middle(ivec2 cell) {
    return float(SIDE) * (vec2(cell) + 0.5) - 0.5;
}

// A plane (1/z and its change per pixel) at another place, this many pixels away.
vec3 moved_plane(vec3 plane, vec2 off) {
    return vec3(plane.x + dot(plane.yz, off), plane.yz);
}

// A candidate: a plane at the place; no vote if it does not reach it. hidden_below: see estimation/stereo_shadows.py
vec4 candidate_of(vec3 plane, float votes, float hidden_below) {
    float seen = hidden_below > 0.0 && plane.x > hidden_below ? UNSEEN : 1.0;
    return vec4(plane, plane.x > 0.0 ? votes * seen : 0.0);
}

// The share of a vote that a likeness of colours leaves.
float color_vote(float likeness) {
    return UNLIKE + likeness;
}

// The share of its vote that is left of a plane that only the likeness of colours can prove.
float proven_share(float likeness) {
    return (UNPROVEN * UNLIKE + likeness) / color_vote(likeness);
}

// A colour in one float, in steps of 1/255, and back.
float pack_color(vec3 color) {
    return dot(floor(color * 255.0 + 0.5), vec3(65536.0, 256.0, 1.0));
}

vec3 unpack_color(float number) {
    vec3 high = floor(number / vec3(65536.0, 256.0, 1.0));
    return vec3(high.r, high.gb - 256.0 * high.rg) / 255.0;
}

// The colour that a pixel of the surface has, and 0 in w where it is cut out. SAME_SIZE: whether the picture has its size.
vec4 guide_at(sampler2D color_map, ivec2 pixel, ivec2 size) {
    if (SAME_SIZE == 1) return texelFetch(color_map, pixel, 0);
    float span = GUIDE_SPAN * float(textureSize(color_map, 0).x) / float(size.x);
    bool is_nothing = is_cut_out(color_map, vec2(pixel), vec2(size));
    return vec4(mean_color(color_map, vec2(pixel), vec2(size), span), is_nothing ? 0.0 : 1.0);
}

// The 1/z from which on the sensor would have seen a surface at a pixel, 0 if it may be any. hidden_map: of the frame's own
// size, see estimation/stereo_shadows.py; of one pixel where nothing is known.
float hidden_below_at(sampler2D hidden_map, ivec2 pixel, ivec2 size) {
    vec2 place = (vec2(pixel) + 0.5) * (vec2(textureSize(hidden_map, 0)) / vec2(size));
    return texelFetch(hidden_map, ivec2(place), 0).r;
}
