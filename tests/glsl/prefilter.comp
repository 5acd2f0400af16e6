#version 460
// Light under a lobe about each entry's direction, of the concentration in its last component; irradiance where that is negative;
// where that is below -1, of a sun: its direction and the red of its irradiance.
#define PREFILTER_BINDING 5
#include "entry.glsl"
#include "prefilter.glsl"

vec4 probe(uint i) {
    vec4 e = uintBitsToFloat(entries[i]);
    if (e.w >= 0.0) {
        return vec4(prefiltered(e.xyz, e.w), 0.0);
    }
    if (e.w >= -1.0) {
        return vec4(prefiltered_irradiance(e.xyz), 0.0);
    }
    uint sun = uint(-e.w) - 2u;
    return sun < prefiltered_suns() ? vec4(prefiltered_sun(sun), prefiltered_sun_irradiance(sun).r) : vec4(-1.0);
}
