#version 460
// The first entry of two holds the centre and the concentration, the second a direction and the variance in texels.
#include "entry.glsl"
#include "texel_kernel.glsl"

vec4 probe(uint i) {
    vec4 lobe = uintBitsToFloat(entries[i & ~1u]);
    vec4 at = uintBitsToFloat(entries[i | 1u]);
    return vec4(texel_kernel(lobe.xyz, lobe.w, at.w, at.xyz), 0.0, 0.0, 0.0);
}
