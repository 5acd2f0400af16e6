#version 460
// One level of the mips of moments by clusters: each texel the average of the area that it covers of the level before, at any size.
// src/distribution/mip.rs is the f64 twin.
#include "cover.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 2, binding = 0, rgba16f) uniform readonly image2DArray before;
layout(set = 2, binding = 1, rgba16f) uniform writeonly image2DArray next;

void main() {
    ivec3 p = ivec3(gl_GlobalInvocationID);
    ivec2 size = imageSize(next).xy, from = imageSize(before).xy;
    if (any(greaterThanEqual(p.xy, size))) {
        return;
    }
    Cover columns = cover(p.x, from.x, size.x), rows = cover(p.y, from.y, size.y);
    vec4 sum = vec4(0.0);
    for (int y = rows.first; y <= rows.last; ++y) {
        vec4 row = vec4(0.0);
        for (int x = columns.first; x <= columns.last; ++x) {
            row += imageLoad(before, ivec3(x, y, p.z)) * cover_share(columns, x, from.x, size.x);
        }
        sum += row * cover_share(rows, y, from.y, size.y);
    }
    imageStore(next, p, sum);
}
