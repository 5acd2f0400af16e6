#version 460
// Even results: a drawn direction and its density. Odd ones: its radiance, and the density that a look-up gives there.
#include "entry.glsl"
#include "environment.glsl"

vec4 probe(uint i) {
    vec2 uv = environment_place(entries[i].xy);
    vec4 w = environment_direction(uv);
    vec4 light = environment_fetch(uv);
    if ((i & 1u) == 0u) {
        return vec4(w.xyz, environment_per_steradian(light.a, w.w));
    }
    return vec4(light.rgb, environment_per_steradian(environment_lookup(w.xyz).a, length(w.xz)));
}
