// The distant environment: radiance and sampling density in one texture, texels by an alias table.
// src/sampling/environment.rs is the f64 twin.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#include "sobol.glsl"

layout(set = 2, binding = 1) uniform sampler2D environment_map;    // radiance; density in 1/(unit of uv)
layout(set = 2, binding = 2) uniform usampler2D environment_alias; // threshold as float bits; alias row << 16 | column

// Radiance and density over uv at a place.
vec4 environment_fetch(vec2 uv) {
    return textureLod(environment_map, uv, 0.0) * vec4(vec3(frame.environment.y), 1.0);
}

// Radiance and density over uv towards world direction w.
vec4 environment_lookup(vec3 w) {
    vec2 uv = latlong_uv(w);
    return environment_fetch(vec2(uv.x - frame.environment.x, uv.y));
}

// A density over uv as one per steradian: d(omega) = 2 pi^2 sin(theta) d(uv).
float environment_per_steradian(float density, float sin_theta) {
    return density / max(2.0 * PI * PI * sin_theta, 1e-7);
}

float tent(float u) {
    return u < 0.5 ? sqrt(2.0 * u) - 1.0 : 1.0 - sqrt(2.0 - 2.0 * u);
}

// A place in the map: a texel by the alias table, then a tent about its centre, so that the density over uv is the bilinear
// interpolation of the texels' own.
vec2 environment_place(uvec2 u) {
    uvec2 size = uvec2(textureSize(environment_map, 0));
    // floor(u * width * height) as row and column, without a division
    uint row, column, fraction;
    umulExtended(u.x, size.y, row, fraction);
    umulExtended(fraction, size.x, column, fraction);
    uvec2 entry = texelFetch(environment_alias, ivec2(column, row), 0).xy;
    float threshold = uintBitsToFloat(entry.x);
    float f = to_unit(fraction);
    bool aliased = f >= threshold;
    f = aliased ? (f - threshold) / (1.0 - threshold) : f / threshold;
    uvec2 texel = aliased ? uvec2(entry.y & 0xffffu, entry.y >> 16) : uvec2(column, row);
    vec2 uv = (vec2(texel) + 0.5 + vec2(tent(min(f, 1.0)), tent(to_unit(u.y)))) / vec2(size);
    uv.y = uv.y < 0.0 ? -uv.y : (uv.y > 1.0 ? 2.0 - uv.y : uv.y);
    return uv;
}

// World direction of a place, and sin(theta) in w.
vec4 environment_direction(vec2 uv) {
    return latlong_direction(vec2(uv.x + frame.environment.x, uv.y));
}

#endif
