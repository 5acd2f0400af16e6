#version 460
// Even results: radiance and density over uv towards a direction. Odd ones: that density per steradian.
#include "entry.glsl"
#include "environment.glsl"

vec4 probe(uint i) {
    vec3 w = uintBitsToFloat(entries[i].xyz);
    vec4 light = environment_lookup(w);
    return (i & 1u) == 0u ? light : vec4(environment_per_steradian(light.a, length(w.xz)), 0.0, 0.0, 0.0);
}
