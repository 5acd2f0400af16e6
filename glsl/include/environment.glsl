// The distant environment: radiance and sampling density in one texture, the intervals that texels are drawn from in another.
// src/sampling/environment.rs and inversion.rs are the f64 twins.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#include "sobol.glsl"

layout(set = 2, binding = 1) uniform sampler2D environment_map;        // radiance; density in 1/(unit of uv)
layout(set = 2, binding = 2) uniform usampler2D environment_intervals; // start and guide, of texels in their row and of rows

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

// The index below count that u draws from the intervals at origin + i * step, and u's place in the index's interval.
uint environment_draw(uint u, uint count, ivec2 origin, ivec2 step, out float place) {
    uint part, unused;
    umulExtended(u, count, part, unused);
    uint low = part == 0u ? 0u : texelFetch(environment_intervals, origin + step * int(part - 1u), 0).y;
    uint high = texelFetch(environment_intervals, origin + step * int(part), 0).y;
    while (low < high) {
        uint middle = high - (high - low) / 2u;
        if (texelFetch(environment_intervals, origin + step * int(middle), 0).x <= u) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    uint start = texelFetch(environment_intervals, origin + step * int(low), 0).x;
    uint end = low + 1u < count ? texelFetch(environment_intervals, origin + step * int(low + 1u), 0).x : 0u;
    // Lengths are modulo 2^32, and what is drawn is not empty.
    place = (float(u - start) + 0.5) / (float(end - start - 1u) + 1.0);
    return low;
}

// A row, a texel of the row, then a tent about its centre: the density is the bilinear interpolation of the texels' own.
EnvironmentSample environment_sample(uvec2 u) {
    uvec2 size = uvec2(textureSize(environment_map, 0));
    vec2 place;
    bool tall = size.y > size.x; // the rows' own intervals stand beside the map, else below it
    uint row = environment_draw(u.y, size.y, ivec2(tall ? size.x : 0u, tall ? 0u : size.y), ivec2(!tall, tall), place.y);
    uint column = environment_draw(u.x, size.x, ivec2(0, row), ivec2(1, 0), place.x);
    place = min(place, vec2(1.0));
    vec2 uv = (vec2(column, row) + 0.5 + vec2(tent(place.x), tent(place.y))) / vec2(size);
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
