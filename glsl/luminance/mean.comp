#version 460
// Mean luminance of what the frame before covered: partial sums in fixed order, by one group. src/frequency/luminance.rs is the
// f64 twin.
#include "frame.glsl"

layout(local_size_x = 64) in;

layout(set = 2, binding = 1, std430) readonly buffer Tiles {
    vec4 tiles[];
};
layout(set = 2, binding = 2, std430) writeonly buffer Mean {
    float mean;
};

shared vec2 partial[64];

void main() {
    uvec2 count = (frame.extent.xy / frame.extent.z + 7u) / 8u;
    uint lane = gl_LocalInvocationIndex;
    vec2 sum = vec2(0.0);
    for (uint i = lane; i < count.x * count.y; i += 64u) {
        sum += tiles[i].zw;
    }
    partial[lane] = sum;
    barrier();
    if (lane == 0u) {
        vec2 all = vec2(0.0);
        for (int i = 0; i < 64; ++i) {
            all += partial[i];
        }
        mean = all.x / max(all.y, 1.0);
    }
}
