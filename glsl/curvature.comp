#version 460
// Principal curvatures of the surface at every sample.
layout(set = 2, binding = 1, rgba16f) uniform writeonly image2D curvature; // k1, k2 in 1/m, |k1| >= |k2|; positive is convex
layout(set = 2, binding = 2) uniform sampler2D normals;                   // as the filter pass writes them
#include "curvature.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float LARGEST = 6e4; // 16-bit float

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(p), frame.extent.xy))) {
        return;
    }
    vec2 k = gbuffer_covered(p) ? principal_curvatures(place_at(p)) : vec2(0.0);
    imageStore(curvature, p, vec4(clamp(k, -LARGEST, LARGEST), 0.0, 0.0));
}
