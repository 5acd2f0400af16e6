#version 460
// How many of the listed samples are in each bin of weights.
#include "allocation.glsl"
#include "list.glsl"

layout(local_size_x = LIST_GROUP) in;

layout(set = 2, binding = 0, std430) readonly buffer Arguments {
    uint groups_x, groups_y, groups_z;
    uint count;
} arguments;
layout(set = 2, binding = 1, std430) readonly buffer List {
    uint list[];
};
layout(set = 2, binding = 2) uniform sampler2D prediction; // of each block, as the bandwidth pass writes it
layout(set = 2, binding = 3, std430) buffer Histogram {
    uint histogram[ALLOCATION_BINS];
};

layout(push_constant) uniform Push {
    int side;       // of a block, in samples
    float by_level; // added to the logarithm of a weight for each level
} push;

void main() {
    uint index = list_index();
    if (index < arguments.count) {
        uint entry = list[index];
        float log_weight = allocation_weight(prediction, entry, push.side, push.by_level);
        atomicAdd(histogram[allocation_bin(log_weight, entry)], 1u);
    }
}
