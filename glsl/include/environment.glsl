// The distant environment: radiance and sampling density in one texture, texels by an alias table.
// src/sampling/environment.rs is the f64 twin.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#include "sobol.glsl"

layout(set = 2, binding = 1) uniform sampler2D environment_map;    // radiance; density in 1/(unit of uv)
layout(set = 2, binding = 2) uniform usampler2D environment_alias; // threshold as float bits, alias

// Radiance and density over uv towards world direction w.
vec4 environment_lookup(vec3 w) {
    vec2 uv = latlong_uv(w);
    return textureLod(environment_map, vec2(uv.x - frame.environment.x, uv.y), 0.0) * vec4(vec3(frame.environment.y), 1.0);
}

// A density over uv as one per steradian: d(omega) = 2 pi^2 sin(theta) d(uv).
float environment_per_steradian(float density, float sin_theta) {
    return density / max(2.0 * PI * PI * sin_theta, 1e-7);
}

struct EnvironmentSample {
    vec3 direction;
    vec3 radiance;
    float density; // 1/sr
};

float tent(float u) {
    return u < 0.5 ? sqrt(2.0 * u) - 1.0 : 1.0 - sqrt(2.0 - 2.0 * u);
}

// A texel by the alias table, then a tent about its centre: the density is the bilinear interpolation of the texels' own.
EnvironmentSample environment_sample(uvec2 u) {
    uvec2 size = uvec2(textureSize(environment_map, 0));
    uint index, fraction;
    umulExtended(u.x, size.x * size.y, index, fraction);
    uvec2 entry = texelFetch(environment_alias, ivec2(index % size.x, index / size.x), 0).xy;
    float threshold = uintBitsToFloat(entry.x);
    float f = to_unit(fraction);
    bool aliased = f >= threshold;
    f = aliased ? (f - threshold) / (1.0 - threshold) : f / threshold;
    uint texel = aliased ? entry.y : index;
    vec2 uv = (vec2(texel % size.x, texel / size.x) + 0.5 + vec2(tent(min(f, 1.0)), tent(to_unit(u.y)))) / vec2(size);
    uv.y = uv.y < 0.0 ? -uv.y : (uv.y > 1.0 ? 2.0 - uv.y : uv.y);
    vec4 texture_value = textureLod(environment_map, uv, 0.0);
    vec4 w = latlong_direction(vec2(uv.x + frame.environment.x, uv.y));
    EnvironmentSample s;
    s.direction = w.xyz;
    s.radiance = texture_value.rgb * frame.environment.y;
    s.density = environment_per_steradian(texture_value.a, w.w);
    return s;
}

#endif
