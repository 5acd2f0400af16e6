#version 460
// Pairs of entries: light direction and alpha, view direction. Results: the specular lobe with f0 = 1.
#include "entry.glsl"
#include "ggx.glsl"

vec4 probe(uint i) {
    uvec4 a = entries[i & ~1u], b = entries[i | 1u];
    vec3 wi = uintBitsToFloat(a.xyz), wo = uintBitsToFloat(b.xyz);
    return vec4(ggx_evaluate(vec3(1.0), vec3(0.0), uintBitsToFloat(a.w), wi, wo, normalize(wi + wo)), 0.0);
}
