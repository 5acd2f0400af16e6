#version 460
// Two integers a call, as four 16-bit halves: a float holds them whatever its bits would mean.
#include "entry.glsl"
#include "sobol.glsl"

vec4 halves(uvec2 v) {
    return vec4(v.x & 0xffffu, v.x >> 16, v.y & 0xffffu, v.y >> 16);
}

vec4 probe(uint i) {
    uvec4 e = entries[i];
    switch (e.w) {
    case 0u:
        return halves(uvec2(hash(e.x), sobol_pascal(e.x)));
    case 1u:
        return halves(uvec2(owen_scramble(e.x, e.y), uint(to_unit(e.x) * 16777216.0)));
    case 2u:
        return halves(sobol_point(e.x, sobol_seeds(e.y)));
    default:
        return halves(random_point(e.x, e.y));
    }
}
