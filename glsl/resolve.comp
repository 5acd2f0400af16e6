#version 460
// Averages the shading samples of each output pixel, with what is known of them beside, if anything is; uncovered ones show the environment where it is visible. Alpha is coverage.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "environment.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 3) uniform sampler2D radiance;
layout(set = 2, binding = 4, rgba32f) uniform writeonly image2D resolved;
layout(set = 2, binding = 5) uniform sampler2D base;

// Whether `radiance` is what `base` lacks, or a factor on it.
layout(constant_id = 0) const uint RESIDUAL = 0u;
layout(constant_id = 1) const uint RATIO = 0u;
// Samples a side of an output pixel: a constant, as quotients by anything else take as long as all of the rest.
layout(constant_id = 2) const int SIDE = 1;

layout(push_constant) uniform Push {
    float offset; // on both sides of a factor, in radiance
} push;

vec3 radiance_at(ivec2 p) {
    vec3 value = texelFetch(radiance, p, 0).rgb;
    if (RESIDUAL != 0u) {
        vec3 known = texelFetch(base, p, 0).rgb;
        value = RATIO != 0u ? max(value * (known + push.offset) - push.offset, 0.0) : value + known;
    }
    return value;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(resolved)))) {
        return;
    }
    vec4 sum = vec4(0.0);
    uint missing = 0u; // bit k: sample k shows the environment
    for (int k = 0; k < SIDE * SIDE; ++k) {
        ivec2 p = pixel * SIDE + ivec2(k % SIDE, k / SIDE);
        bool covered = gbuffer_covered(p);
        // What no surface is at may be undefined.
        sum += covered ? vec4(radiance_at(p), 1.0) : vec4(0.0);
        missing |= covered || frame.extent.w == 0u ? 0u : 1u << k;
    }
    // A loop, as it ends where a branch would be run for nothing.
    while (missing != 0u) {
        int k = findLSB(missing);
        missing &= missing - 1u;
        sum.rgb += environment_lookup(normalize(frame_ray(pixel * SIDE + ivec2(k % SIDE, k / SIDE)))).rgb;
    }
    imageStore(resolved, pixel, sum / float(SIDE * SIDE));
}
