// The distant environment: radiance and sampling density in one texture, what texels are drawn from in another.
// src/sampling/environment.rs, inversion.rs and alias.rs are the f64 twins.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#include "sobol.glsl"

layout(set = 2, binding = 1) uniform sampler2D environment_map;      // radiance; density in 1/(unit of uv)
layout(set = 2, binding = 2) uniform usampler2D environment_entries; // threshold and alias of texels in their row; start and guide of rows

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

// The row that u draws by inversion of the rows' intervals, and u's place in the row's interval.
uint environment_row(uint u, uvec2 size, out float place) {
    bool tall = size.y > size.x; // the rows' own entries stand beside the map, else below it
    ivec2 origin = ivec2(tall ? size.x : 0u, tall ? 0u : size.y);
    ivec2 step = ivec2(!tall, tall);
    uint part, unused;
    umulExtended(u, size.y, part, unused);
    uint low = part == 0u ? 0u : texelFetch(environment_entries, origin + step * int(part - 1u), 0).y;
    uint high = texelFetch(environment_entries, origin + step * int(part), 0).y;
    while (low < high) {
        uint middle = high - (high - low) / 2u;
        if (texelFetch(environment_entries, origin + step * int(middle), 0).x <= u) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    uint start = texelFetch(environment_entries, origin + step * int(low), 0).x;
    uint end = low + 1u < size.y ? texelFetch(environment_entries, origin + step * int(low + 1u), 0).x : 0u;
    // Lengths are modulo 2^32, and what is drawn is not empty.
    place = min((float(u - start) + 0.5) / (float(end - start - 1u) + 1.0), 1.0);
    return low;
}

// The texel of a row that u draws by the row's alias table, and what is left of u.
uint environment_column(uint u, uint row, uint width, out float rest) {
    uint column, fraction;
    umulExtended(u, width, column, fraction);
    uvec2 entry = texelFetch(environment_entries, ivec2(column, row), 0).xy;
    float threshold = uintBitsToFloat(entry.x);
    float f = to_unit(fraction);
    bool kept = f < threshold;
    rest = min(kept ? f / threshold : (f - threshold) / (1.0 - threshold), 1.0);
    return kept ? column : entry.y;
}

// A row, a texel of the row, then a tent about its centre: the density is the bilinear interpolation of the texels' own.
vec2 environment_place(uvec2 u) {
    uvec2 size = uvec2(textureSize(environment_map, 0));
    vec2 place;
    uint row = environment_row(u.y, size, place.y);
    uint column = environment_column(u.x, row, size.x, place.x);
    vec2 uv = (vec2(column, row) + 0.5 + vec2(tent(place.x), tent(place.y))) / vec2(size);
    uv.y = uv.y < 0.0 ? -uv.y : (uv.y > 1.0 ? 2.0 - uv.y : uv.y);
    return uv;
}

// World direction of a place, and sin(theta) in w.
vec4 environment_direction(vec2 uv) {
    return latlong_direction(vec2(uv.x + frame.environment.x, uv.y));
}

#endif
