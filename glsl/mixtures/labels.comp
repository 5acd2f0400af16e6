#version 460
// The finest texels of a map's mixtures: each of their lobes belongs to that Gaussian, of what lies between those of the level above,
// which has the most of it.
#define MIXTURES_BINDING 1
#include "mixtures.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 2, binding = 0, std430) readonly buffer Lobes {
    vec4 lobes[];
};
layout(set = 2, binding = 2, rgba32f) uniform writeonly image2DArray gaussians;
layout(push_constant) uniform Push {
    ivec2 above; // size of the level above
    int first;   // vector of that
    int count;   // of a texel's lobes
    int layer;
    uint upright;
    float least;
};

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(gaussians).xy;
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    Prior none = Prior(vec4(0.0), vec4(0.0), vec4(0.0), 0.0);
    Components c = components_of(between(first, above, p, size), vec4(0.0), vec4(0.0), none, least, SAMPLES_A_LOBE);
    int from = (p.y * size.x + p.x) * (upright != 0u ? count : count + 1);
    vec2 normal = upright != 0u ? vec2(0.0) : lobes[from + count].xy;
    vec4 q = vec4(0.0), x = vec4(0.0), y = vec4(0.0), square = vec4(0.0);
    for (int i = 0; i < count; ++i) {
        vec4 lobe = lobes[from + i];
        vec4 own = first_greatest(scores(c, lobe)) * lobe.w;
        q += own;
        x += own * lobe.x;
        y += own * lobe.y;
        square += own * (dot(lobe.xy, lobe.xy) + 2.0 * lobe.z);
    }
    for (int k = 0; k < 4; ++k) {
        imageStore(gaussians, ivec3(p, layer + k), vec4(q[k], x[k], y[k], square[k]));
        if (upright == 0u) {
            imageStore(gaussians, ivec3(p, layer + 4 + k), vec4(q[k] * normal, 0.0, 0.0));
        }
    }
}
