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
#include "frame.glsl"
#include "gbuffer.glsl"
#include "materials.glsl"
#include "local.glsl"
#include "lobes.glsl"
#include "lights.glsl"
#include "prefilter.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Whether the frame has lights beside the environment.
layout(constant_id = 1) const bool LOCAL_LIGHTS = false;

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

// What light from unit world direction w adds, of irradiance `power` at normal incidence.
vec3 reflected_light(Local f, Material m, Lobes l, vec3 w, vec3 power) {
    vec3 wi = vec3(dot(w, f.x), dot(w, f.y), dot(w, f.z));
    bool above = wi.z > 0.0;
    wi = above ? wi : f.view;
    vec3 h = normalize(wi + f.view), value = vec3(0.0);
    if (UNFILTERED != 0u) {
        value = material_evaluate(m, wi, f.view, h) * wi.z;
    }
    if (LOBED != 0u) {
        vec3 found = lobes_evaluate(m, l, wi, f.view, h).rgb;
        value = l.count > 0u ? found : value;
    }
    return above ? value * power : vec3(0.0);
}

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
    for (uint i = 0u; i < a.count; ++i) {
        ReflectedLobe lobe = approximation_lobe(m, l, a, i, f.view);
        sum += lobe.weight * prefiltered(to_world(f, lobe.direction), EXACT != 0u ? min(lobe.kappa, prefiltered_most()) : lobe.kappa);
    }
    for (uint i = 0u; i < prefiltered_suns(); ++i) {
        sum += reflected_light(f, m, l, prefiltered_sun(i), prefiltered_sun_irradiance(i));
    }
    if (LOCAL_LIGHTS) {
        vec3 at = frame.eye.xyz + ray * gbuffer_depth(p);
        for (uint i = 0u; i < frame.lights.x; ++i) {
            vec4 w = light_exact(lights[i], at);
            sum += reflected_light(f, m, l, w.xyz, lights[i].power.rgb * w.w);
        }
    }
    imageStore(radiance, p, vec4(sum, 1.0));
}
