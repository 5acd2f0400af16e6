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
    SunRecord record = environment_suns.list.all[min(sun, MAX_SUNS - 1u)];
    return sun < suns_count() ? vec4(suns_direction(record.place.xy), record.irradiance.r * frame.environment.y) : vec4(-1.0);
}
