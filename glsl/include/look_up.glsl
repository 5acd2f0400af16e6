// Maps as layers of at most eight arrays, and look-ups over what a pixel covers of them (src/material.rs, struct Reach, is the f64
// twin). A map's place is 0 for none, else (layer << 3 | class) + 1; classes that are not used are compiled away.
#ifndef LOOK_UP_GLSL
#define LOOK_UP_GLSL

// Most look-ups along the longer axis of a footprint, and what is added to their level.
layout(constant_id = 9) const uint ANISOTROPY = 1u;
layout(constant_id = 10) const float LOD_BIAS = 0.0;

layout(set = 2, binding = 2) uniform sampler2DArray textures_0;
layout(set = 2, binding = 3) uniform sampler2DArray textures_1;
layout(set = 2, binding = 4) uniform sampler2DArray textures_2;
layout(set = 2, binding = 5) uniform sampler2DArray textures_3;
layout(set = 2, binding = 6) uniform sampler2DArray textures_4;
layout(set = 2, binding = 7) uniform sampler2DArray textures_5;
layout(set = 2, binding = 8) uniform sampler2DArray textures_6;
layout(set = 2, binding = 9) uniform sampler2DArray textures_7;

// What a pixel covers of a map: look-ups along the longer axis, at a level whose texels are as large as the step from one to the
// next; with one look-up, as large as the longer axis.
struct Reach {
    vec2 size; // of the map
    vec2 axis;
    float taps;
    float level;
};

#define SIZE(i) \
    if ((classes & (1u << i)) != 0u) { \
        size = slot == i ? vec2(textureSize(textures_##i, 0).xy) : size; \
    }
Reach reach_of(uint classes, uint code, vec4 footprint) {
    int slot = (int(code) - 1) & 7;
    vec2 size = vec2(1.0);
    SIZE(0)
    SIZE(1)
    SIZE(2)
    SIZE(3)
    SIZE(4)
    SIZE(5)
    SIZE(6)
    SIZE(7)
    vec2 x = footprint.xy * size, y = footprint.zw * size;
    float xx = dot(x, x), yy = dot(y, y), major = max(max(xx, yy), 1.0), minor = max(min(xx, yy), 1.0);
    float taps = clamp(ceil(sqrt(major / minor) - 1e-3), 1.0, float(ANISOTROPY));
    return Reach(size, xx > yy ? footprint.xy : footprint.zw, taps, max(0.5 * log2(max(major / (taps * taps), 1.0)) + LOD_BIAS, 0.0));
}

// Where look-up i is taken.
vec2 reach_tap(Reach r, vec2 uv, float i) {
    return uv + r.axis * ((i + 0.5) / r.taps - 0.5);
}

// A map's value, of `layer` after its own, at a level. Textures count rows from the top, coordinates upwards.
#define FETCH(i) \
    if ((classes & (1u << i)) != 0u) { \
        vec4 fetched = textureLod(textures_##i, at, level); \
        value = slot == i ? fetched : value; \
    }
vec4 fetch(uint classes, uint code, uint layer, vec2 uv, float level) {
    bool none = code == 0u;
    int slot = none ? -1 : (int(code) - 1) & 7;
    vec3 at = none ? vec3(0.0) : vec3(uv.x, 1.0 - uv.y, float((code - 1u >> 3) + layer));
    vec4 value = vec4(0.0);
    FETCH(0)
    FETCH(1)
    FETCH(2)
    FETCH(3)
    FETCH(4)
    FETCH(5)
    FETCH(6)
    FETCH(7)
    return value;
}

// The mean over what a pixel covers.
vec4 look_up(uint classes, uint code, uint layer, vec2 uv, Reach r) {
    vec4 sum = fetch(classes, code, layer, reach_tap(r, uv, 0.0), r.level);
    for (float i = 1.0; ANISOTROPY != 1u && i < r.taps; ++i) {
        sum += fetch(classes, code, layer, reach_tap(r, uv, i), r.level);
    }
    return sum / r.taps;
}

vec3 colour(uint classes, uint code, vec2 uv, vec4 footprint, float without) {
    vec3 value = look_up(classes, code, 0u, uv, reach_of(classes, code, footprint)).rgb;
    return code == 0u ? vec3(without) : value;
}

#endif
