#version 460
// Entry: material, view cosine, two random words. Even results: half vector and density. Odd ones: the smooth density there.
#include "entry.glsl"
#include "materials.glsl"

vec4 probe(uint i) {
    uvec4 e = entries[i];
    Material m = material_load(e.x, uintBitsToFloat(e.y));
    vec4 h = material_sample(m, e.zw);
    return (i & 1u) == 0u ? h : vec4(material_density(m, h.xyz), 0.0, 0.0, 0.0);
}
