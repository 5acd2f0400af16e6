#version 460
// The finest texels that are kept by cells: each the average of the lobes of the base texels that it covers, cell by cell (Xu
// et al. 2017, section 3.2). A base texel has its lobes as they are. Cells in camera space are made of the lobes as each texel's
// frame turns them, and of none where a texel has no frame. src/distribution/filter.rs is the f64 twin.
#include "cover.glsl"
#include "moments.glsl"
#include "tangent.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
// FILTER_* of moments.glsl.
layout(constant_id = 0) const uint FILTER = 0u;
// Whether cells are in camera space.
layout(constant_id = 1) const bool CAMERA = false;
layout(set = 2, binding = 0, rgba32f) uniform readonly image2DArray lobes;
layout(set = 2, binding = 1, rgba32f) uniform writeonly image2DArray cells;
layout(set = 2, binding = 2, rgba32f) uniform readonly image2DArray frames; // as texture_space.frag writes them
layout(push_constant) uniform Push {
    vec4 weights;
    vec4 view_from_world[3]; // columns
    uint count;
    int lobe_layer; // the first lobe's; the mean normal is before it, if lobes are not about the normal
    int cell_layer;
    int frame_layer;
    uint upright;
};

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(cells).xy, from = imageSize(lobes).xy;
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    vec4 sums[CELLS];
    float spreads[CELLS];
    vec4 normals[CELLS];
    for (uint i = 0u; i < CELLS; ++i) {
        sums[i] = vec4(0.0);
        spreads[i] = 0.0;
        normals[i] = vec4(0.0);
    }
    Cover columns = cover(p.x, from.x, size.x), rows = cover(p.y, from.y, size.y);
    for (int y = rows.first; y <= rows.last; ++y) {
        for (int x = columns.first; x <= columns.last; ++x) {
            float share = cover_share(columns, x, from.x, size.x) * cover_share(rows, y, from.y, size.y);
            mat3 turn = mat3(1.0);
            if (CAMERA) {
                vec4 at = imageLoad(frames, ivec3(x, y, frame_layer));
                if (at.xyz == vec3(0.0)) {
                    continue;
                }
                mat3 view = mat3(view_from_world[0].xyz, view_from_world[1].xyz, view_from_world[2].xyz);
                turn = view * tangent_frame(at.xyz, tangent_decode(at.xyz, at.w));
            }
            vec4 normal = upright != 0u ? vec4(0.0) : imageLoad(lobes, ivec3(x, y, lobe_layer - 1));
            normal.xyz = CAMERA ? moments_turned(turn, normal.xyz) : normal.xyz;
            for (uint i = 0u; i < count; ++i) {
                vec4 lobe = imageLoad(lobes, ivec3(x, y, lobe_layer + int(i)));
                lobe.xyz = CAMERA ? moments_turned(turn, lobe.xyz) : lobe.xyz;
                float weight = share * weights[i];
                uint cell = moments_cell(filter_cells(FILTER), vec3(lobe.xy, 1.0 - lobe.z));
                // Selected, not indexed: lanes would go to memory for a place of their own.
                for (uint k = 0u; k < CELLS; ++k) {
                    float mine = k == cell ? weight : 0.0;
                    sums[k] += vec4(lobe.xyz, 1.0) * mine;
                    spreads[k] += lobe.w * mine;
                    normals[k] += vec4(normal.xyz, 1.0) * mine;
                }
            }
        }
    }
    int cell_count = int(filter_cells(FILTER));
    for (int i = 0; i < cell_count; ++i) {
        imageStore(cells, ivec3(p, cell_layer + i), sums[i]);
        if (upright == 0u) {
            imageStore(cells, ivec3(p, cell_layer + int(filter_normals(FILTER)) + i), normals[i]);
        }
    }
    for (int i = 0; i < cell_count; i += 4) {
        vec4 four = vec4(spreads[i], spreads[i + 1], spreads[i + 2], spreads[i + 3]);
        imageStore(cells, ivec3(p, cell_layer + cell_count + i / 4), four);
    }
}
