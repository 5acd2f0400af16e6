#version 460
// The list of samples with their directions, most first: lanes that run in lock step wait for the one with the most. The order
// within a bin depends on scheduling; nothing that reads the list depends on its order.
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
layout(set = 2, binding = 3, std430) readonly buffer Shares {
    Share shares[ALLOCATION_BINS];
};
layout(set = 2, binding = 4, std430) buffer Cursors {
    uint cursors[ALLOCATION_BINS]; // samples of a bin that have their place
};
layout(set = 2, binding = 5, std430) writeonly buffer Allocated {
    uvec2 allocated[]; // entry of the list, directions
};

layout(push_constant) uniform Push {
    vec2 range;     // fewest and most directions of a sample
    int side;       // of a block, in samples
    float by_level; // added to the logarithm of a weight for each level
} push;

void main() {
    uint index = list_index();
    if (index < arguments.count) {
        uint entry = list[index];
        float log_weight = allocation_weight(prediction, entry, push.side, push.by_level);
        uint bin = allocation_bin(log_weight, entry);
        Share share = shares[bin];
        allocated[share.first + atomicAdd(cursors[bin], 1u)] =
            uvec2(entry, allocation_directions(share.directions, push.range, entry));
    }
}
