#version 460
// How coarsely each sample's residual may be shaded, by the share of light that the lobes which stand for its material miss: what they
// miss little of varies little.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "materials.glsl"
#include "local.glsl"
#define FIT_BINDING 2
#include "fit.glsl"
#include "lights.glsl"
#define SHADOWS_BINDING 4
#include "shadows.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 1) uniform sampler2D normals; // as the filter pass writes them
layout(set = 2, binding = 3, r32ui) uniform writeonly uimage2D level;

layout(push_constant) uniform Push {
    vec2 errors; // up to the first the coarsest level, up to the second that of half the pixels a side
    uint coarsest;
    uint half_rate;
    uint finest;
} push;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(p), frame.extent.xy)) || !gbuffer_covered(p)) {
        return;
    }
    Local f = local_frame(texelFetch(normals, p, 0).xyz, -normalize(frame_ray(p)));
    Material m;
    m.record = materials[gbuffer_material(p)];
    Fit fit = fit_load(m, f.view.z);
    float error = fit.count > 0u ? fit.error : 1.0;
    uint found = error <= push.errors.x ? push.coarsest : (error <= push.errors.y ? push.half_rate : push.finest);
    imageStore(level, p, uvec4(shadow_level(p, found)));
}
