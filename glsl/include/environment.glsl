// The distant environment: radiance and sampling density in one texture, what texels are drawn from in another.
// src/sampling/environment.rs and inversion.rs are the f64 twins.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#include "sobol.glsl"

layout(set = 2, binding = 1) uniform sampler2D environment_map;      // radiance; density in 1/(unit of uv)
layout(set = 2, binding = 2) uniform usampler2D environment_entries; // where intervals start, and the guides to them

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

uint environment_entry(uint column, uint row) {
    return texelFetch(environment_entries, ivec2(column, row), 0).x;
}

// The index below count that u draws by inversion, and u's place in the index's interval. Starts and guides are rows of
// environment_entries.
uint environment_draw(uint u, uint count, uint starts, uint guides, out float place) {
    uint part, unused;
    umulExtended(u, count, part, unused);
    uint guide = environment_entry(part, guides);
    uint low = guide & 0xffffu;
    uint high = guide >> 16;
    while (low < high) {
        uint middle = high - (high - low) / 2u;
        if (environment_entry(middle, starts) <= u) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    uint start = environment_entry(low, starts);
    uint end = low + 1u < count ? environment_entry(low + 1u, starts) : 0u;
    // Lengths are modulo 2^32, and what is drawn is not empty.
    place = min((float(u - start) + 0.5) / (float(end - start - 1u) + 1.0), 1.0);
    return low;
}

// A row, a texel of the row, then a tent about its centre: the density is the bilinear interpolation of the texels' own.
vec2 environment_place(uvec2 u) {
    uvec2 size = uvec2(textureSize(environment_map, 0));
    vec2 place;
    uint row = environment_draw(u.y, size.y, 2u * size.y, 2u * size.y + 1u, place.y);
    uint column = environment_draw(u.x, size.x, row, size.y + row, place.x);
    vec2 uv = (vec2(column, row) + 0.5 + vec2(tent(place.x), tent(place.y))) / vec2(size);
    uv.y = uv.y < 0.0 ? -uv.y : (uv.y > 1.0 ? 2.0 - uv.y : uv.y);
    return uv;
}

// World direction of a place, and sin(theta) in w.
vec4 environment_direction(vec2 uv) {
    return latlong_direction(vec2(uv.x + frame.environment.x, uv.y));
}

#endif
