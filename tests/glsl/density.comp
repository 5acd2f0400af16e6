#version 460
// Pairs of entries: half vector and material; view cosine. Results: the smooth density.
#include "entry.glsl"
#include "materials.glsl"

vec4 probe(uint i) {
    uvec4 a = entries[i & ~1u];
    Material m = material_load(a.w, uintBitsToFloat(entries[i | 1u].x));
    return vec4(material_density(m, uintBitsToFloat(a.xyz)), 0.0, 0.0, 0.0);
}
