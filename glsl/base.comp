#version 460
// Noise-free radiance of every sample: the environment under the lobes that stand for the material, irradiance on its diffuse part,
// and suns and exact lights by the reflectance itself.
// Whether the filter widens lobes.
layout(constant_id = 0) const bool KERNEL = false;
#define MATERIAL_KERNEL KERNEL
// A bit for each kind of reflectance that there is.
layout(constant_id = 15) const uint KINDS = 31u;
#define MATERIAL_KINDS KINDS
#define PREFILTER_BINDING 5
#define LOBES_BINDING 9
#define FIT_BINDING 10
#define SHADOWS_BINDING 11
#include "frame.glsl"
#include "gbuffer.glsl"
#include "materials.glsl"
#include "local.glsl"
#include "lobes.glsl"
#include "lights.glsl"
#include "shadows.glsl"
#include "prefilter.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Whether the frame has lights beside the environment.
layout(constant_id = 1) const bool LOCAL_LIGHTS = false;
// Whether the environment may have suns.
layout(constant_id = 2) const bool SUNS = true;

// Where the filter finds lobes: whether there are materials beside, which stay as they are.
layout(constant_id = 10) const uint UNFILTERED = 1u;
// Whether no lobe is sharper than the sharpest level, beyond which the map is looked up.
layout(constant_id = 14) const uint EXACT = 0u;
#include "approximation.glsl"

layout(set = 2, binding = 1) uniform sampler2D normals;  // as the filter pass writes them
layout(set = 2, binding = 2) uniform usampler2D factors;
layout(set = 2, binding = 3, std430) readonly buffer Lights {
    LightRecord lights[];
};
layout(set = 2, binding = 4, rgba32f) uniform writeonly image2D radiance;
#include "direct.glsl"

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(p), frame.extent.xy)) || !gbuffer_covered(p)) {
        return;
    }
    vec3 ray = frame_ray(p);
    vec4 normal = texelFetch(normals, p, 0);
    Local f = local_frame(normal.xyz, -normalize(ray));
    Material m = material_load(gbuffer_material(p), f.view.z, tangent_turn(f, tangent_decode(normal.xyz, normal.w)),
        factors_unpack(texelFetch(factors, p, 0)));

    Lobes l = lobes_load(p, f, m);

    Approximation a = approximation_load(m, l, f.view);
    vec3 sum = a.diffuse * prefiltered_irradiance(f.z);
    float sharpest = 0.0;
    for (uint i = 0u; i < a.count; ++i) {
        ReflectedLobe lobe = approximation_lobe(m, l, a, i, f.view);
        sharpest = max(sharpest, lobe.kappa);
        sum += lobe.weight * prefiltered(to_world(f, lobe.direction), EXACT != 0u ? min(lobe.kappa, prefiltered_most()) : lobe.kappa);
    }
    if (SUNS) {
        sum += reflected_suns(f, m, l, a, sharpest);
    }
    if (LOCAL_LIGHTS) {
        sum += reflected_lights(f, m, l, frame.eye.xyz + ray * gbuffer_depth(p), p);
    }
    imageStore(radiance, p, vec4(sum, 1.0));
}
