#version 460
// Pairs of entries: light direction and material, view direction. Even results: reflectance; odd ones: with the directions swapped.
#include "entry.glsl"
#include "materials.glsl"

vec4 probe(uint i) {
    uvec4 a = entries[i & ~1u], b = entries[i | 1u];
    vec3 wi = uintBitsToFloat(a.xyz), wo = uintBitsToFloat(b.xyz);
    if ((i & 1u) != 0u) {
        vec3 swap = wi;
        wi = wo;
        wo = swap;
    }
    return vec4(material_evaluate(material_load(a.w, wo.z), wi, wo, normalize(wi + wo)), 0.0);
}
