#version 460
// The level of each sample, in levels over a sample, by its tile's contrast. src/frequency/luminance.rs is the f64 twin.
#include "frame.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 1, std430) readonly buffer Tiles {
    vec4 tiles[];
};
layout(set = 2, binding = 2, std430) readonly buffer Mean {
    float mean;
};
layout(set = 2, binding = 3, r32ui) uniform writeonly uimage2D level;

const float NOTICEABLE = 0.15;
const float AMBIENT = 0.05;
const float QUARTER = 2.13;

void main() {
    uvec2 p = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(p, frame.extent.xy))) {
        return;
    }
    uint side = frame.extent.z, columns = (frame.extent.x / side + 7u) / 8u;
    uvec2 at = p / (side * 8u);
    vec4 tile = tiles[at.y * columns + at.x];
    float unseen = NOTICEABLE * (tile.x + AMBIENT * mean);
    uint coarser = tile.y * QUARTER <= unseen ? 2u : (tile.y <= unseen ? 1u : 0u);
    imageStore(level, ivec2(p), uvec4(coarser == 0u ? 0u : coarser + uint(findMSB(side))));
}
