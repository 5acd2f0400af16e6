#version 460
// Last word 0: coordinates of a direction. 1: the direction of coordinates. 2: coordinates there and back.
#include "entry.glsl"
#include "latlong.glsl"

vec4 probe(uint i) {
    uvec4 e = entries[i];
    vec3 v = uintBitsToFloat(e.xyz);
    if (e.w == 0u) {
        return vec4(latlong_uv(v), 0.0, 0.0);
    }
    vec4 w = latlong_direction(v.xy);
    return e.w == 1u ? w : vec4(latlong_uv(w.xyz), 0.0, 0.0);
}
