#version 460
// Lists the blocks of samples that carry a surface, and apart from them one in stride x stride to look at first. The order of
// entries depends on scheduling; nothing that reads them depends on it.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "forecast.glsl"
#include "list.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 1, std430) buffer Found {
    Forecast forecast;
};
layout(set = 2, binding = 2, std430) writeonly buffer Blocks {
    uint blocks[]; // those to look at first; from push.all on all of them
};

layout(push_constant) uniform Push {
    int side;   // of a block, in samples
    int stride; // one block in so many a side is looked at first
    uint all;
} push;

shared uint counts[2];
shared uint places[2];

void main() {
    ivec2 block = ivec2(gl_GlobalInvocationID.xy), extent = ivec2(frame.extent.xy), first = block * push.side;
    // The covered sample nearest to the middle stands for the block.
    int representative = 0, nearest = 1 << 20;
    for (int k = 0; k < push.side * push.side; ++k) {
        ivec2 o = ivec2(k % push.side, k / push.side);
        ivec2 d = o * 2 - push.side + 1;
        int distance = d.x * d.x + d.y * d.y;
        bool inside = all(lessThan(first + o, extent));
        bool nearer = gbuffer_covered(min(first + o, extent - 1)) && inside && distance < nearest;
        nearest = nearer ? distance : nearest;
        representative = nearer ? k : representative;
    }
    bool covered = nearest != 1 << 20;
    bool early = covered && all(equal(block % push.stride, ivec2(push.stride / 2)));
    uint lane = gl_LocalInvocationIndex;
    if (lane < 2u) {
        counts[lane] = 0u;
    }
    barrier();
    uint slot_first = early ? atomicAdd(counts[0], 1u) : 0u;
    uint slot = covered ? atomicAdd(counts[1], 1u) : 0u;
    barrier();
    if (lane == 0u && counts[0] > 0u) {
        places[0] = atomicAdd(forecast.first, counts[0]);
        uint groups = (places[0] + counts[0] + LIST_GROUP - 1u) / LIST_GROUP;
        atomicMax(forecast.first_x, min(groups, LIST_ROW));
        atomicMax(forecast.first_y, (groups + LIST_ROW - 1u) / LIST_ROW);
    }
    if (lane == 0u && counts[1] > 0u) {
        places[1] = atomicAdd(forecast.blocks, counts[1]);
        uint groups = (places[1] + counts[1] + LIST_GROUP - 1u) / LIST_GROUP;
        atomicMax(forecast.blocks_x, min(groups, LIST_ROW));
        atomicMax(forecast.blocks_y, (groups + LIST_ROW - 1u) / LIST_ROW);
    }
    barrier();
    uint entry = block_entry(block, representative);
    if (early) {
        blocks[places[0] + slot_first] = entry;
    }
    if (covered) {
        blocks[push.all + places[1] + slot] = entry;
    }
}
