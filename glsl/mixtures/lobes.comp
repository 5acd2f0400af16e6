#version 460
// The lobes of each texel of a map as their mixtures are fitted to them: place in the stereographic plane from the map's middle,
// variance, mass; and behind those of a texel, where they are not about it, the place of its normal.
#include "moments.glsl"
#include "stereographic.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 2, binding = 0, rgba32f) uniform readonly image2DArray of_map;
layout(set = 2, binding = 1, std430) writeonly buffer Lobes {
    vec4 lobes[];
};
layout(push_constant) uniform Push {
    vec4 weights;
    vec2 middle;
    int count;
    int layer;    // the first lobe's
    uint kind;    // LOBES_* of moments.glsl
    uint upright; // whether they are about the normal, which is in the layer before theirs else
};

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(of_map).xy;
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    int to = (p.y * size.x + p.x) * (upright != 0u ? count : count + 1);
    for (int i = 0; i < count; ++i) {
        vec4 lobe = imageLoad(of_map, ivec3(p, layer + i));
        vec2 s = stereographic_of(lobe.xyz);
        float scale = stereographic_scale(s), variance = scale * scale / max(lobe.w, 0.25);
        lobes[to + i] = vec4(s - middle, variance, weights[i] / moments_area(lobe.w, kind));
    }
    if (upright == 0u) {
        lobes[to + count] = vec4(stereographic_of(imageLoad(of_map, ivec3(p, layer - 1)).xyz), 0.0, 0.0);
    }
}
