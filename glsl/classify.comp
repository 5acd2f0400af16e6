#version 460
// Lists the shading samples that carry a surface, tile by tile. The order of tiles depends on scheduling; nothing that
// reads the list depends on its order. But neighbours read the same parts of their material's tables, and a frame of many
// materials reads more tables than caches hold: tiles are taken column by column from stripes of STRIPE of them.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "list.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Bits of x in an entry of the list: 16, or 14 in a frame that has levels (list_entry of list.glsl at level 0).
layout(constant_id = 0) const int X_BITS = 16;

layout(set = 2, binding = 1, std430) buffer Arguments {
    uint groups_x, groups_y, groups_z; // of the indirect dispatch
    uint count;
} arguments;
layout(set = 2, binding = 2, std430) writeonly buffer List {
    uint list[]; // y << X_BITS | x
};

shared uint tile_first;
shared uint tile_count;

void main() {
    ivec2 tile = ivec2(gl_WorkGroupID.y, gl_WorkGroupID.z * STRIPE + gl_WorkGroupID.x);
    ivec2 p = tile * ivec2(gl_WorkGroupSize.xy) + ivec2(gl_LocalInvocationID.xy);
    bool covered = all(lessThan(uvec2(p), frame.extent.xy)) && gbuffer_covered(p);
    if (gl_LocalInvocationIndex == 0u) {
        tile_count = 0u;
    }
    barrier();
    uint slot = covered ? atomicAdd(tile_count, 1u) : 0u;
    barrier();
    if (gl_LocalInvocationIndex == 0u && tile_count > 0u) {
        tile_first = atomicAdd(arguments.count, tile_count);
        uint groups = (tile_first + tile_count + LIST_GROUP - 1u) / LIST_GROUP;
        atomicMax(arguments.groups_x, min(groups, LIST_ROW));
        atomicMax(arguments.groups_y, (groups + LIST_ROW - 1u) / LIST_ROW);
    }
    barrier();
    if (covered) {
        list[tile_first + slot] = uint(p.y) << X_BITS | uint(p.x);
    }
}
