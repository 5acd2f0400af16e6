// The suns of an environment as src/pass/prefilter.rs packs them (src/distribution/suns.rs says what they are). An includer that
// reads them defines SUNS_BINDING.
#ifndef SUNS_GLSL
#define SUNS_GLSL

struct SunRecord {
    vec4 place;      // map coordinates; z: squared distance from the unit direction to that of its furthest point
    vec4 irradiance; // at normal incidence
    ivec4 texels;    // first column, columns after it, first and last row
    uvec4 points;    // the first and their number
};

// Of what shows a sun's shape.
struct SunPoint {
    vec4 place;
    vec4 irradiance;
};

const uint MAX_SUNS = 8u;
const uint MAX_POINTS = 64u; // of a sun

struct SunList {
    vec4 scale;   // 1 / the largest concentration of a lobe; factors of 2 from there to the least; 1 / those from the map to there
    vec4 rule;    // largest channel of texels that are no sun's; that of a sun's texel in what is left of the map
    ivec4 count;  // x
    SunRecord all[MAX_SUNS];
    SunPoint points[MAX_SUNS * MAX_POINTS];
};

#ifdef SUNS_BINDING
#include "frame.glsl"
#include "latlong.glsl"
layout(set = 2, binding = SUNS_BINDING, std430) readonly buffer EnvironmentSuns {
    SunList list;
} environment_suns;

uint suns_count() {
    return uint(environment_suns.list.count.x);
}

// World direction towards a place of the map.
vec3 suns_direction(vec2 place) {
    return latlong_direction(place + vec2(frame.environment.x, 0.0)).xyz;
}
#endif

#endif
