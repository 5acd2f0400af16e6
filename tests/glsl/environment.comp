#version 460
// Even results: a drawn direction and its density. Odd ones: its radiance, and the density that a look-up gives there.
#include "entry.glsl"
#include "environment.glsl"

vec4 probe(uint i) {
    EnvironmentSample s = environment_sample(entries[i].xy);
    if ((i & 1u) == 0u) {
        return vec4(s.direction, s.density);
    }
    float density = environment_lookup(s.direction).a;
    return vec4(s.radiance, environment_per_steradian(density, length(s.direction.xz)));
}
