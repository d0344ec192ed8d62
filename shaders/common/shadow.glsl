#include "common/camera.glsl"
#include "common/texels.glsl"

// Shadows: a light's views of the scene lie as tiles in one depth picture, 1 - near/z; here they are asked whether
// anything nearer to the light stands before a point. One row of `views` a view:
// texels 0 to 2  rows of the matrix that takes the lit point's axes to those of the light's camera
// texel 3        focal length, centre (the same in x and y), tile's first column and row; pixels
// texel 4        near, pixels a side, contact: by how much an occluder must stand out of the surface

const float FLATTEST = 0.1;   // cosine: a receiver seen flatter by the light is taken to be tilted no more

// 1/z of the picture at a pixel of a tile; 0 where nothing is, and outside the tile.
float occluder_at(sampler2D shadow_map, vec2 pixel, vec4 tile, vec3 range) {
    if (any(lessThan(pixel, vec2(0.0))) || any(greaterThan(pixel, vec2(range.y - 1.0)))) return 0.0;
    return (1.0 - texel_at(shadow_map, ivec2(pixel + tile.zw)).r) / range.x;
}

// Weights of the three pixels round a position (quadratic B-spline); offset is -0.5 to 0.5 from the middle one.
vec3 tent(float offset) {
    float before = 0.5 - offset;
    float after = 0.5 + offset;
    return vec3(0.5 * before * before, 0.75 - offset * offset, 0.5 * after * after);
}

// Share of a light's view `row` that reaches the point: 1 in the light, 0 in full shadow, between at a soft edge. The
// occluders are compared with the receiver's own tangent plane at their place, so that a slanted surface does not shade
// itself (receiver plane depth bias: Isidoro 2006).
float light_share(sampler2D shadow_map, sampler2D views, int row, vec3 point, vec3 n) {
    mat3 turn = transpose(mat3(
        texelFetch(views, ivec2(0, row), 0).xyz,
        texelFetch(views, ivec2(1, row), 0).xyz,
        texelFetch(views, ivec2(2, row), 0).xyz
    ));
    vec3 shift = vec3(
        texelFetch(views, ivec2(0, row), 0).w, texelFetch(views, ivec2(1, row), 0).w, texelFetch(views, ivec2(2, row), 0).w
    );
    vec4 tile = texelFetch(views, ivec2(3, row), 0);
    vec3 range = texelFetch(views, ivec2(4, row), 0).xyz;
    vec3 seen = turn * point + shift;
    if (seen.z <= range.x) return 1.0;
    vec4 intrinsics = vec4(tile.xx, tile.yy);
    vec2 at = project(seen, intrinsics);
    vec3 normal = turn * n;
    vec3 ray = seen / seen.z;
    float cosine = dot(normal, ray), away = abs(cosine);
    cosine = sign(cosine) * max(abs(cosine), FLATTEST * length(ray));
    vec2 slope = cosine == 0.0 ? vec2(0.0) : normal.xy / (intrinsics.xy * (cosine * seen.z));
    vec2 middle = floor(at + 0.5);
    vec3 across = tent(at.x - middle.x);
    vec3 down = tent(at.y - middle.y);
    float share = 0.0;
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 3; ++x) {
            vec2 pixel = middle + vec2(x - 1, y - 1);
            float own = max(1.0 / seen.z + dot(slope, pixel - at), 0.0);
            float occluder = occluder_at(shadow_map, pixel, tile, range);
            share += (occluder - own) * away > range.z * own * occluder ? 0.0 : across[x] * down[y];
        }
    }
    return share;
}

// Which of the six views of a point light a direction from it falls into: +x, -x, +y, -y, +z, -z.
int cube_face(vec3 direction) {
    vec3 size = abs(direction);
    if (size.x >= size.y && size.x >= size.z) return direction.x > 0.0 ? 0 : 1;
    if (size.y >= size.z) return direction.y > 0.0 ? 2 : 3;
    return direction.z > 0.0 ? 4 : 5;
}
