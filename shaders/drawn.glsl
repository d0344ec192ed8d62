// What splats.frag and set_splats.frag have in common: which pixels of its point a splat covers.
#include "common/rim_splat.glsl"

uniform sampler2D surface_map;
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform bool is_round;
uniform int first_id;

flat in vec2 centre;
flat in vec4 to_source;
flat in vec2 bend;
flat in float reach;
flat in int id;
flat in float inverse_depth;
flat in vec2 tilt;
flat in vec4 to_target;
flat in vec4 rim;  // outward, width (0: it is none), drop

// 1/z of the splat at this pixel; 0 where it covers it not.
float covering_inverse_depth() {
    vec2 q = gl_FragCoord.xy - 0.5, offset = q - centre;
    Footprint splat = Footprint(centre, to_target, inverse_depth, tilt, bend);
    float here = 0.0;
    if (rim.z == 0.0 && footprint_covers(to_source, bend, offset, reach, is_round)) {
        here = footprint_inverse_depth(splat, to_source, offset);
    }
    int rims = rim.z > 0.0 ? 1 : 0;  // a loop is left out where no pixel takes it, a branch is not
    for (int k = 0; k < rims; ++k) {
        ivec2 pixel = pixel_of(id - first_id, textureSize(surface_map, 0).x);
        Rim own = Rim(rim.xy, rim.z, rim.w);
        vec4 surface = surface_at(surface_map, pixel);
        here = rim_inverse_depth(own, vec2(pixel), surface, inverse_depth, q, source, view, target);
    }
    return here;
}
