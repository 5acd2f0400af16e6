#version 460
// Averages the shading samples of each output pixel; uncovered ones show the environment where it is visible. Alpha is coverage.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "environment.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 3) uniform sampler2D radiance;
layout(set = 2, binding = 4, rgba32f) uniform writeonly image2D resolved;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    int side = int(frame.extent.z);
    if (any(greaterThanEqual(pixel, ivec2(frame.extent.xy) / side))) {
        return;
    }
    vec4 sum = vec4(0.0);
    for (int k = 0; k < side * side; ++k) {
        ivec2 p = pixel * side + ivec2(k % side, k / side);
        if (gbuffer_covered(p)) {
            sum += vec4(texelFetch(radiance, p, 0).rgb, 1.0);
        } else if (frame.extent.w != 0u) {
            sum.rgb += environment_lookup(normalize(frame_ray(p))).rgb;
        }
    }
    imageStore(resolved, pixel, sum / float(side * side));
}
