#version 460
// How coarsely each sample's residual may be shaded, by the share of light that the lobes which stand for its material miss: what they
// miss little of varies little. Fits say it; of lobes that the filter found a few directions do.
layout(constant_id = 2) const bool KERNEL = false;
#define MATERIAL_KERNEL KERNEL
#define LOBES_BINDING 6
#define FIT_BINDING 2
#define SHADOWS_BINDING 4
#include "frame.glsl"
#include "gbuffer.glsl"
#include "materials.glsl"
#include "local.glsl"
#include "lobes.glsl"
#include "lights.glsl"
#include "shadows.glsl"
#include "luminance.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Where the filter finds lobes: whether there are materials beside, which stay as they are.
layout(constant_id = 10) const uint UNFILTERED = 1u;
#include "surface.glsl"
#include "approximation.glsl"

layout(set = 2, binding = 1) uniform sampler2D normals; // as the filter pass writes them
layout(set = 2, binding = 3, r32ui) uniform writeonly uimage2D level;
layout(set = 2, binding = 5) uniform usampler2D factors;

layout(push_constant) uniform Push {
    vec2 errors; // up to the first the coarsest level, up to the second that of half the pixels a side
    uint coarsest;
    uint half_rate;
    uint finest;
} push;

// Each invocation has 2x2 samples. One of those with found lobes stands for them: so many directions of it, together with those of
// other invocations, so many a side, of the same material.
const uint DIRECTIONS = 2u;
const uint TOGETHER = 4u;

const uint NO_MATERIAL = 0xffffffffu;
shared vec2 missed[64]; // sums of |f - a| and of the larger of both, each over the density of its direction
shared uint missed_by_material[64];

// Those of directions from the found lobes.
vec2 missed_by(Surface s, Approximation a, uint seed) {
    vec3 wo = s.frame.view, directions[DIRECTIONS];
    float whole[DIRECTIONS], looked_up[DIRECTIONS], per_density[DIRECTIONS];
    uvec2 seeds = sobol_seeds(seed);
    for (uint i = 0u; i < DIRECTIONS; ++i) {
        vec3 wi = lobes_sample(s.material, s.lobes, wo, sobol_point(i, seeds));
        bool drawn = dot(wi, wi) > 0.0;
        wi = drawn ? wi : wo;
        vec4 value = lobes_evaluate(s.material, s.lobes, wi, wo, normalize(wi + wo));
        directions[i] = wi;
        whole[i] = wi.z > 0.0 ? luminance(value.rgb) : 0.0;
        looked_up[i] = luminance(a.diffuse) * max(wi.z, 0.0);
        per_density[i] = drawn ? 1.0 / max(value.a, 1e-30) : 0.0;
    }
    for (uint k = 0u; k < a.count; ++k) {
        ReflectedLobe lobe = approximation_lobe(s.material, s.lobes, a, k, wo);
        for (uint i = 0u; i < DIRECTIONS; ++i) {
            looked_up[i] += luminance(lobe.weight) * vmf_density(lobe.direction, lobe.kappa, directions[i]);
        }
    }
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < DIRECTIONS; ++i) {
        sum += vec2(abs(whole[i] - looked_up[i]), max(whole[i], looked_up[i])) * per_density[i];
    }
    return sum;
}

bool there(ivec2 p) {
    return all(lessThan(uvec2(p), frame.extent.xy)) && gbuffer_covered(p);
}

bool has_lobes(ivec2 p) {
    bool some = false;
    if (there(p)) {
        uvec4 first = texelFetch(lobes_found, ivec3(p, 0), 0);
        some = SLOPES != 0u ? uintBitsToFloat(first.z) > 0.0 : !found_none(first);
    }
    return some;
}

Local local_at(ivec2 p, out vec4 normal) {
    normal = texelFetch(normals, p, 0);
    return local_frame(normal.xyz, -normalize(frame_ray(p)));
}

// What the lobes of one of the samples from `corner` on miss. Chosen first: some devices run a loop's body masked, so often as the last of
// their lanes needs it.
vec2 missed_at(ivec2 corner, out uint material) {
    uint start = hash(uint(corner.y) << 16 | uint(corner.x));
    ivec2 p = ivec2(-1);
    for (uint k = 0u; k < 4u; ++k) {
        uint which = (start + k) & 3u;
        ivec2 q = corner + ivec2(which & 1u, which >> 1);
        p = p.x < 0 && has_lobes(q) ? q : p;
    }
    vec2 found = vec2(0.0);
    material = NO_MATERIAL;
    if (p.x >= 0) {
        vec4 normal;
        Surface s;
        material = gbuffer_material(p);
        s.frame = local_at(p, normal);
        s.material = material_load(material, s.frame.view.z, tangent_turn(s.frame, tangent_decode(normal.xyz, normal.w)),
            factors_unpack(texelFetch(factors, p, 0)));
        s.lobes = lobes_load(p, s.frame, s.material);
        found = missed_by(s, approximation_load(s.material, s.lobes, s.frame.view), start);
    }
    return found;
}

void main() {
    ivec2 corner = ivec2(gl_GlobalInvocationID.xy) * 2;
    float of_lobes = 1.0;
    uint material = NO_MATERIAL;
    if (LOBED != 0u) {
        missed[gl_LocalInvocationIndex] = missed_at(corner, material);
        missed_by_material[gl_LocalInvocationIndex] = material;
        barrier();
        uvec2 first = gl_LocalInvocationID.xy / TOGETHER * TOGETHER;
        vec2 sum = vec2(0.0);
        for (uint i = 0u; i < TOGETHER * TOGETHER; ++i) {
            uint other = (first.y + i / TOGETHER) * 8u + first.x + i % TOGETHER;
            sum += missed_by_material[other] == material ? missed[other] : vec2(0.0);
        }
        of_lobes = sum.y > 0.0 ? sum.x / sum.y : of_lobes;
    }
    for (uint k = 0u; k < 4u; ++k) {
        ivec2 p = corner + ivec2(k & 1u, k >> 1);
        if (!there(p)) {
            continue;
        }
        float error = 1.0;
        if (LOBED != 0u && has_lobes(p)) {
            // Another material in the same 2x2 is at an edge.
            error = gbuffer_material(p) == material ? of_lobes : error;
        } else {
            vec4 normal;
            Local f = local_at(p, normal);
            Material m;
            m.record = materials[gbuffer_material(p)];
            Fit fit = fit_load(m, f.view.z);
            error = fit.count > 0u ? fit.error : error;
        }
        uint found = error <= push.errors.x ? push.coarsest : (error <= push.errors.y ? push.half_rate : push.finest);
        imageStore(level, p, uvec4(shadow_level(p, found)));
    }
}
