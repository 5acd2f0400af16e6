// The distant environment: radiance and sampling density in one texture, the alias table of its texels in another.
// src/sampling/environment.rs and alias.rs are the f64 twins.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#include "sobol.glsl"

layout(set = 2, binding = 1) uniform sampler2D environment_map;      // radiance; density in 1/(unit of uv)
layout(set = 2, binding = 2) uniform usampler2D environment_alias;   // slots as src/sampling/alias.rs packs them, 1024 a row

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
    float t = 1.0 - sqrt(2.0 * min(u, 1.0 - u));
    return u < 0.5 ? -t : t;
}

// A texel by the alias table, then a tent about its centre: the density is the bilinear interpolation of the texels' own.
vec2 environment_place(uvec2 u) {
    int bits = 10 + findMSB(textureSize(environment_alias, 0).y);
    uint index = u.x >> (32 - bits);
    uvec4 slot = texelFetch(environment_alias, ivec2(index & 1023u, index >> 10), 0);
    // What the slot leaves of u.x, refined below its resolution by bits of u.y.
    float steps = float(1 << (32 - bits));
    float at = min(float(int((u.x << bits) >> bits)) + to_unit(u.y * 0x9e3779b9u), steps * (1.0 - 1.0 / 16777216.0));
    float units = float(int(slot.w & 0xfffffu));
    int other_run = int(slot.y & 0x7fffffffu);
    bool own = other_run == 0 || at < units;
    bool single = slot.y >= 0x80000000u;
    units = other_run == 0 ? steps : units;
    int run = own ? (single ? 1 : int(slot.z)) : other_run;
    float along = (own ? at : at - units) / (own ? units : steps - units) * float(run);
    int run_step = min(int(along), run - 1);
    int texel = int(slot.x) + (own ? 0 : (single ? 1 : int(slot.z))) + run_step;
    // An index drawn by itself is shared out among its slots, so that u.x runs through it once.
    vec2 stretch = own ? vec2(ivec2(slot.z & 0xffffu, slot.z >> 16)) * (1.0 / 65535.0) : vec2(0.0, float(int(slot.w >> 20)) * (1.0 / 4095.0));
    stretch = own && !single || !own && other_run > 1 ? vec2(0.0, 1.0) : stretch;
    float place = mix(stretch.x, stretch.y, min(along - float(run_step), 1.0));

    // Row and column by a reciprocal, off by one at most.
    ivec2 size = textureSize(environment_map, 0);
    int row = int(float(texel) * (1.0 / float(size.x)));
    int column = texel - row * size.x;
    row += column < 0 ? -1 : (column >= size.x ? 1 : 0);
    column = texel - row * size.x;

    vec2 uv = (vec2(column, row) + 0.5 + vec2(tent(place), tent(to_unit(u.y)))) / vec2(size);
    uv.y = uv.y < 0.0 ? -uv.y : (uv.y > 1.0 ? 2.0 - uv.y : uv.y);
    return uv;
}

// World direction of a place, and sin(theta) in w.
vec4 environment_direction(vec2 uv) {
    return latlong_direction(vec2(uv.x + frame.environment.x, uv.y));
}

#endif
