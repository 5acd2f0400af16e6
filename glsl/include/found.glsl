// A lobe that the filter found at a sample, in 16 bytes: direction, the normal of the surface below it, concentration and weight,
// which is above 0.
#ifndef FOUND_GLSL
#define FOUND_GLSL
#include "oct.glsl"

// Concentrations are kept by their logarithm to base 2, from -16 to 32, in steps of 0.05 %.
const float FOUND_LEAST = -16.0;
const float FOUND_RANGE = 48.0;

uvec4 found_pack(vec3 mu, vec3 normal, float kappa, float weight) {
    float log_kappa = clamp((log2(max(kappa, 1e-6)) - FOUND_LEAST) / FOUND_RANGE, 0.0, 1.0);
    uint low = packHalf2x16(vec2(max(weight, 6.2e-5), 0.0)) & 0xffffu;
    return uvec4(floatBitsToUint(oct_encode(mu)), packSnorm2x16(oct_encode(normal)), uint(log_kappa * 65535.0 + 0.5) << 16 | low);
}

bool found_none(uvec4 u) {
    return (u.w & 0xffffu) == 0u;
}

vec3 found_direction(uvec4 u) {
    return oct_decode(uintBitsToFloat(u.xy));
}

vec3 found_normal(uvec4 u) {
    return oct_decode(unpackSnorm2x16(u.z));
}

float found_concentration(uvec4 u) {
    return exp2(float(u.w >> 16) * (FOUND_RANGE / 65535.0) + FOUND_LEAST);
}

float found_weight(uvec4 u) {
    return unpackHalf2x16(u.w & 0xffffu).x;
}

#endif
