#version 460
// The finest texels that are kept by clusters: each the average of the moments of the lobes of the base texels that it covers. A base
// texel has its lobes as they are. src/distribution/clusters.rs is the f64 twin.
#include "cover.glsl"
#define CLUSTERS_BINDING 2
#include "clusters.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 2, binding = 0, rgba32f) uniform readonly image2DArray lobes;
layout(set = 2, binding = 1, rgba16f) uniform writeonly image2DArray cells;
layout(push_constant) uniform Push {
    vec4 weights;
    uint count;
    int lobe_layer; // the first lobe's
    int cell_layer;
    uint kind;      // LOBES_* of moments.glsl
    uint first;     // cluster of the material's
    uint all;       // of these
    uint upright;   // whether lobes are about the normal, which is in the layer before theirs else
    uint coloured;  // whether their specular colour is in the layer behind theirs
};

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(cells).xy, from = imageSize(lobes).xy;
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    vec4 firsts[MOST_CLUSTERS];
    vec4 seconds[MOST_CLUSTERS]; // with the normal
    for (uint i = 0u; i < MOST_CLUSTERS; ++i) {
        firsts[i] = vec4(0.0);
        seconds[i] = vec4(0.0);
    }
    vec3 thirds[MOST_COLOURED];
    for (uint i = 0u; i < MOST_COLOURED; ++i) {
        thirds[i] = vec3(0.0);
    }
    Cover columns = cover(p.x, from.x, size.x), rows = cover(p.y, from.y, size.y);
    for (int y = rows.first; y <= rows.last; ++y) {
        for (int x = columns.first; x <= columns.last; ++x) {
            float share = cover_share(columns, x, from.x, size.x) * cover_share(rows, y, from.y, size.y);
            vec2 normal = upright != 0u ? vec2(0.0) : stereographic_of(imageLoad(lobes, ivec3(x, y, lobe_layer - 1)).xyz);
            vec3 colour = coloured == 0u ? vec3(0.0) : imageLoad(lobes, ivec3(x, y, lobe_layer + int(count))).rgb;
            for (uint i = 0u; i < count; ++i) {
                vec4 lobe = imageLoad(lobes, ivec3(x, y, lobe_layer + int(i)));
                Placed placed = cluster_place(first, all, lobe.xyz, lobe.w, share * weights[i], kind);
                // Selected, not indexed: lanes would go to memory for a place of their own.
                for (uint k = 0u; k < MOST_CLUSTERS; ++k) {
                    bool mine = k == placed.cluster;
                    firsts[k] += mine ? placed.first : vec4(0.0);
                    seconds[k] += mine ? vec4(placed.second, normal * placed.first.x) : vec4(0.0);
                }
                for (uint k = 0u; k < MOST_COLOURED; ++k) {
                    thirds[k] += k == placed.cluster ? colour * placed.first.x : vec3(0.0);
                }
            }
        }
    }
    for (uint i = 0u; i < MOST_CLUSTERS; ++i) {
        if (i < all) {
            imageStore(cells, ivec3(p, cell_layer + int(i)), firsts[i]);
        }
        if (i < all && upright == 0u) {
            imageStore(cells, ivec3(p, cell_layer + int(all + i)), seconds[i]);
        }
    }
    for (uint i = 0u; i < MOST_COLOURED; ++i) {
        if (i < all && coloured != 0u) {
            imageStore(cells, ivec3(p, cell_layer + int(clusters_colour(i, all, upright))), vec4(thirds[i], 0.0));
        }
    }
    for (uint i = 0u; i < MOST_CLUSTERS; i += 2u) {
        if (i < all && upright != 0u) {
            imageStore(cells, ivec3(p, cell_layer + int(all + i / 2u)), vec4(seconds[i].xy, seconds[i + 1u].xy));
        }
    }
}
