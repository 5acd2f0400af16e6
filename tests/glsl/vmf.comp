#version 460
// The first entry of two holds mean direction and concentration, the second a direction and a spread.
#include "entry.glsl"
#include "vmf.glsl"

vec4 probe(uint i) {
    vec4 lobe = uintBitsToFloat(entries[i & ~1u]);
    vec4 at = uintBitsToFloat(entries[i | 1u]);
    if ((i & 1u) == 0u) {
        return vec4(vmf_mean_cosine(lobe.w), vmf_spread(lobe.w), vmf_concentration(at.w), vmf_density(lobe.xyz, lobe.w, at.xyz));
    }
    return vec4(vmf_concentration(vmf_spread(lobe.w)), vmf_normalisation(lobe.w), 0.0, 0.0);
}
