#version 460
// Pairs of entries: light direction and material, view direction. Results: column and row.
#include "entry.glsl"
#include "lobe_bandwidth.glsl"

vec4 probe(uint i) {
    uvec4 a = entries[i & ~1u], b = entries[i | 1u];
    return vec4(lobe_bandwidth_texel(int(a.w), uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz)), 0.0, 0.0);
}
