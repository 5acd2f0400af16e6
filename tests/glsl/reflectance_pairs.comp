#version 460
// Evaluates pairs of directions: of entries 2i (wi, material) and 2i + 1 (wo, turn in radians), output 2i is the reflectance.
#include "materials.glsl"

layout(local_size_x = 64) in;

layout(set = 2, binding = 3, std430) readonly buffer Input {
    uvec4 entries[];
};
layout(set = 2, binding = 4, std430) writeonly buffer Output {
    vec4 values[];
};
layout(push_constant) uniform Push {
    uint count;
} push;

void main() {
    uint i = 2u * gl_GlobalInvocationID.x;
    if (i + 1u >= push.count) {
        return;
    }
    vec3 wi = uintBitsToFloat(entries[i].xyz);
    vec3 wo = uintBitsToFloat(entries[i + 1u].xyz);
    float turn = uintBitsToFloat(entries[i + 1u].w);
    // As without maps: vMF lobes have no diffuse base.
    Factors factors = NO_FACTORS;
    factors.albedo *= materials[entries[i].w].kind.x == REFLECTANCE_VMF ? 0.0 : 1.0;
    Material m = material_load(entries[i].w, wo.z, vec3(cos(turn), sin(turn), 1.0), factors);
    vec3 h = normalize(wi + wo);
    values[i] = vec4(material_evaluate(m, wi, wo, h), material_density(m, h));
    values[i + 1u] = material_sample(m, entries[i].xy ^ entries[i + 1u].zx);
}
