// The environment under von Mises-Fisher lobes, by concentration, without its suns; irradiance; the suns. Rotation costs nothing.
// src/distribution/prefilter.rs and suns.rs are the f64 twins. The includer defines PREFILTER_BINDING, the first of four.
#ifndef PREFILTER_GLSL
#define PREFILTER_GLSL
#include "frame.glsl"
#include "latlong.glsl"
#define SUNS_BINDING PREFILTER_BINDING + 3
#include "suns.glsl"

layout(set = 2, binding = PREFILTER_BINDING) uniform sampler2D prefilter_first;      // level 0 the map, then x4 less a level
layout(set = 2, binding = PREFILTER_BINDING + 1) uniform sampler2D prefilter_second; // twice the first's next level, with its own level's size
layout(set = 2, binding = PREFILTER_BINDING + 2) uniform sampler2D prefilter_irradiance;

// Columns wrap, rows go on beyond the poles.
vec2 prefilter_uv(vec3 w) {
    vec2 uv = latlong_uv(w);
    return vec2(uv.x - frame.environment.x, uv.y * 0.8 + 0.1);
}

// Mean radiance under a lobe of concentration kappa about world direction w.
vec3 prefiltered(vec3 w, float kappa) {
    // Steps of a factor of 2 down from the second's level 0; above it is the map.
    float steps = min(-log2(kappa * environment_suns.list.scale.x), environment_suns.list.scale.y);
    float first = floor(0.5 * steps) + 1.0, second = floor(0.5 * steps + 0.5);
    float weight = 1.0 - abs(steps - (2.0 * first - 1.0));
    bool map = steps < 0.0;
    first = map ? 0.0 : first;
    second = map ? 0.0 : min(second, first);
    weight = map ? min(-steps * environment_suns.list.scale.z, 1.0) : weight;
    vec2 uv = prefilter_uv(w);
    vec3 a = textureLod(prefilter_first, uv, first).rgb, b = textureLod(prefilter_second, uv, second).rgb;
    return mix(b, a, weight) * frame.environment.y;
}

// Concentration of the sharpest level.
float prefiltered_most() {
    return 1.0 / environment_suns.list.scale.x;
}

// On a surface with world normal n.
vec3 prefiltered_irradiance(vec3 n) {
    return textureLod(prefilter_irradiance, prefilter_uv(n), 0.0).rgb * frame.environment.y;
}

#endif
