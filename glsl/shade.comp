#version 460
#extension GL_EXT_control_flow_attributes : require
// Reflected radiance of listed samples by N directions each, the same number or one of their own (Bagher 2011, equations 1 and 2,
// sections 2.3 and 3.3): half from the reflectance, half from the environment, combined by the balance heuristic; or all from the
// reflectance; or of what the lobes that stand for the material leave of it, which `base` knows the rest of.
// Whether the filter widens lobes.
layout(constant_id = 3) const bool KERNEL = false;
#define MATERIAL_KERNEL KERNEL
#define LOBES_BINDING 10
#define FIT_BINDING 11
#define SHADOWS_BINDING 14
#include "frame.glsl"
#include "gbuffer.glsl"
#include "materials.glsl"
#include "local.glsl"
#include "environment.glsl"
#include "lights.glsl"
#include "shadows.glsl"
#include "sobol.glsl"
#include "lobes.glsl"
#include "list.glsl"
#include "luminance.glsl"
#include "levels.glsl"

layout(local_size_x = LIST_GROUP) in;

layout(constant_id = 0) const uint ESTIMATOR = 0u;
const uint ESTIMATOR_MIS = 0u;
const uint ESTIMATOR_BRDF = 1u;
const uint ESTIMATOR_BRDF_RANDOM = 2u;
const uint ESTIMATOR_LOOKUP = 3u;
const uint ESTIMATOR_RESIDUAL = 4u;
// Whether the frame has lights beside the environment. Without them their loops are compiled away: some devices run a
// loop's body once, masked, even for no iteration.
layout(constant_id = 1) const bool LOCAL_LIGHTS = false;
// Whether entries are samples that stand for cells of some level, or all samples.
layout(constant_id = 2) const bool LEVELLED = false;
// So many levels below a pixel's share the pixel's directions.
layout(constant_id = 4) const int SHARING = 0;
// Whether entries carry a number of directions.
layout(constant_id = 5) const bool ALLOCATED = false;
// Where the filter finds lobes: whether there are materials beside, which stay as they are.
layout(constant_id = 10) const uint UNFILTERED = 1u;
#include "surface.glsl"
#include "approximation.glsl"
#define SUNS_BINDING 13
#include "suns.glsl"
#include "control_variate.glsl"
// Whether what is left is stored as a factor on what the lobes reflect that stand for a material.
layout(constant_id = 15) const uint RATIO = 0u;
// Whether directions are drawn from the reflectance alone.
layout(constant_id = 17) const uint ALONE = 0u;
// Share of the directions that are not the reflectance's.
layout(constant_id = 18) const float OTHER_SHARE = 0.5;

layout(set = 2, binding = 3, std430) readonly buffer Arguments {
    uint groups_x, groups_y, groups_z;
    uint count;
} arguments;
layout(set = 2, binding = 4, std430) readonly buffer List {
    uint list[]; // entries; with a number of directions behind each if ALLOCATED
};
layout(set = 2, binding = 5, rgba32f) uniform writeonly image2D radiance;
layout(set = 2, binding = 6, std430) readonly buffer Lights {
    LightRecord lights[]; // exact ones first
};
layout(set = 2, binding = 7, rgba32f) uniform writeonly image2D odd; // of odd levels; `radiance` is of even ones

layout(set = 2, binding = 8) uniform sampler2D normals;  // as the filter pass writes them
layout(set = 2, binding = 9) uniform usampler2D factors;
layout(set = 2, binding = 12) uniform sampler2D base; // radiance by those lobes, suns and exact lights
#include "direct.glsl"

// Estimates whose squares are this many variances are as good as none beside lobes that miss nothing: what measured best of 0.5, 1 and 2
// with 16 and 64 directions.
const float NOISE = 2.0;

layout(push_constant) uniform Push {
    uint brdf_samples; // of a sample that stands for a pixel or more, as Directions::split of src/plan.rs shares them out; if ALLOCATED, each entry's own number is
    uint environment_samples;
    uint light_samples; // for each area light
    float offset; // on both sides of a factor, in radiance
    float negligible; // errors up to this are left as they are
} push;

// This sample's.
ivec2 place;
uint brdf_samples, environment_samples, light_samples;

// What a sample `finer` levels below a pixel's gets of the pixel's directions (src/plan.rs, Directions::at).
uint share(uint n, int finer) {
    return max(n >> uint(2 * finer), min(n, 1u));
}

// Whose turn it is on the pixel's one sequence of points: that of a cell of level l, in an order in which a cell has the points
// of its children. A pixel's samples, averaged, are then as well spread as the points of one.
uint turn(ivec2 p, int l, int finer) {
    ivec2 inside = (p >> l) & ((1 << finer) - 1);
    return uint((inside.x & 1) | (inside.y & 1) << 1 | (inside.x & 2) << 1 | (inside.y & 2) << 2);
}

// Directions::split of src/plan.rs: a share from the reflectance; the others in equal parts from the environment and each area light,
// as far as there are any.
void split(uint n) {
    uint area = LOCAL_LIGHTS ? frame.lights.y : 0u;
    uint sources = area + (push.environment_samples > 0u ? 1u : 0u);
    if (ALONE != 0u || sources == 0u) {
        brdf_samples = n;
        environment_samples = 0u;
        light_samples = 0u;
        return;
    }
    uint other = min(uint(float(n) * OTHER_SHARE), n - 1u);
    light_samples = area > 0u ? max(other / sources, 1u) : 0u;
    brdf_samples = n - other;
    environment_samples = push.environment_samples > 0u ? uint(max(int(other) - int(light_samples * area), 1)) : 0u;
}

// What light from a direction adds: the environment's by the reflectance, and by the lobes that are looked up in its place; area lights'.
struct Contribution {
    vec3 whole, looked_up, lights;
};

const Contribution NOTHING = Contribution(vec3(0.0), vec3(0.0), vec3(0.0));

Contribution contribution(Surface s, vec3 reflected, vec3 wi, vec3 light) {
    vec3 looked_up = ESTIMATOR == ESTIMATOR_RESIDUAL ? approximation(s.frame, wi) * light : vec3(0.0);
    return Contribution(reflected * light, looked_up, vec3(0.0));
}

// Reflectance times the cosine for light from local wi, h the half vector, and in a the density per steradian of wi for the weights
// of directions. Below the horizon, where only a residual asks, it is 0.
vec4 reflected(Surface s, vec3 wi, vec3 h) {
    vec3 wo = s.frame.view;
    bool above = ESTIMATOR != ESTIMATOR_RESIDUAL || wi.z > 0.0;
    vec3 toward = above ? wi : wo;
    vec4 of_lobes = vec4(0.0);
    if (LOBED != 0u) {
        of_lobes = lobes_evaluate(s.material, s.lobes, wi, wo, h);
    }
    vec4 whole = vec4(0.0);
    if (UNFILTERED != 0u) {
        whole = vec4(material_evaluate(s.material, toward, wo, above ? h : wo) * toward.z, material_density(s.material, h) * 0.25 / dot(wo, h));
        whole.a = above || h.z > 0.0 ? whole.a : 0.0;
    }
    vec4 value = lobed(s) ? of_lobes : whole;
    value.rgb = above ? value.rgb : vec3(0.0);
    return value;
}

// Contribution of a direction drawn from the reflectance, seen from world point p. The environment and every area light
// weigh it against their own samples (balance heuristic, one light at a time: lights add up).
Contribution brdf_contribution(Surface s, vec3 p, uvec2 u) {
    Drawn d = surface_sample(s, u);
    vec3 wi = d.wi;
    if (ESTIMATOR == ESTIMATOR_RESIDUAL ? dot(wi, wi) == 0.0 : wi.z <= 0.0) {
        return NOTHING;
    }
    vec3 w = to_world(s.frame, wi);
    vec4 light = environment_lookup(w);
    vec4 value = reflected(s, wi, d.h);
    bool alone = ALONE != 0u;
    float drawn = d.density > 0.0 ? d.density : value.a;
    float weight_density = alone ? drawn : value.a;
    float brdf = float(brdf_samples) * weight_density;
    float environment = alone ? 0.0 : float(environment_samples) * environment_per_steradian(light.a, length(w.xz));
    float weight = weight_density / drawn;
    Contribution sum = contribution(s, value.rgb, wi, light.rgb * (weight / (brdf + environment)));
    for (uint i = 0u; LOCAL_LIGHTS && i < frame.lights.y; ++i) {
        float density = light_density(lights[frame.lights.x + i], p, w);
        float competing = alone ? 0.0 : float(light_samples) * density;
        sum.lights += density > 0.0 ? value.rgb * shadowed(lights[frame.lights.x + i], place) * (weight / (brdf + competing)) : vec3(0.0);
    }
    return sum;
}

// Contribution of a direction drawn from the environment.
Contribution environment_contribution(Surface s, uvec2 u) {
    Local f = s.frame;
    vec2 uv = environment_place(u);
    vec4 w = environment_direction(uv);
    vec3 wi = vec3(dot(w.xyz, f.x), dot(w.xyz, f.y), dot(w.xyz, f.z));
    bool above = ESTIMATOR == ESTIMATOR_RESIDUAL || wi.z > 0.0;
    // Where lanes run in lock step without masked loads, those below the horizon read one common place instead of scattered ones.
    uv = above ? uv : vec2(0.0);
    wi = above ? wi : vec3(0.0, 0.0, 1.0);
    vec4 light = environment_fetch(uv);
    vec4 value = reflected(s, wi, normalize(wi + f.view));
    float environment = float(environment_samples) * environment_per_steradian(light.a, w.w);
    float brdf = float(brdf_samples) * value.a;
    return contribution(s, value.rgb, wi, above ? light.rgb / (brdf + environment) : vec3(0.0));
}

// Contribution of a direction drawn from an area light.
vec3 light_contribution(Surface s, vec3 p, LightRecord light, uvec2 u) {
    Local f = s.frame;
    vec3 w = light_sample(light, p, vec2(to_unit(u.x), to_unit(u.y)));
    vec3 wi = vec3(dot(w, f.x), dot(w, f.y), dot(w, f.z));
    float density = light_density(light, p, w);
    if (wi.z <= 0.0 || density <= 0.0) {
        return vec3(0.0);
    }
    vec4 value = reflected(s, wi, normalize(wi + f.view));
    return value.rgb * shadowed(light, place) / (float(brdf_samples) * value.a + float(light_samples) * density);
}

// Reflectance and radiance in an arbitrary direction: no estimate, but the look-ups that every estimate is made of.
vec3 lookup(Surface s, uint u) {
    vec3 wi = normalize(vec3(uvec3(u, u >> 10, u >> 20) & 1023u) - 511.25);
    wi.z = abs(wi.z);
    return reflected(s, wi, normalize(wi + s.frame.view)).rgb * environment_lookup(to_world(s.frame, wi)).rgb;
}

// Sums of contributions; for what is decided by their noise, also of luminances and their products, whose variances are those of
// directions that are drawn alike.
struct Tally {
    Contribution sum;
    vec2 luminances; // of this kind of directions: whole, looked up
    vec3 products;   // whole squared, both, looked up squared
    vec3 variances;  // of the sums, in the same order, of the kinds before
};

void tally(inout Tally t, Contribution c) {
    t.sum.whole += c.whole;
    t.sum.looked_up += c.looked_up;
    t.sum.lights += c.lights;
    if (RATIO != 0u) {
        vec2 y = vec2(luminance(c.whole), luminance(c.looked_up));
        t.luminances += y;
        t.products += vec3(y.x * y.x, y.x * y.y, y.y * y.y);
    }
}

// All n directions of a kind are there.
void tally_kind(inout Tally t, uint n) {
    if (RATIO != 0u) {
        vec2 y = t.luminances;
        vec3 about = t.products - vec3(y.x * y.x, y.x * y.y, y.y * y.y) / float(max(n, 1u));
        t.variances += n > 1u ? about * (float(n) / float(n - 1u)) : vec3(0.0);
        t.luminances = vec2(0.0);
        t.products = vec3(0.0);
    }
}

// What the lobes lack, and as much of it as is no noise. The estimate is a regression: of what is looked up, whose true sum is `known`,
// as much is taken out as makes the noise least. Where that is still as large as the estimate, the lobes alone are nearer, unless they are
// known to miss a share `error` of light.
vec3 lacking(Tally t, vec3 known, float error) {
    float both = t.variances.y, looked_up = t.variances.z;
    float share = looked_up > 0.0 ? clamp(both / looked_up, 0.0, 1.0) : 1.0;
    vec3 found = t.sum.whole - share * t.sum.looked_up - (1.0 - share) * known;
    float variance = max(t.variances.x + share * (share * looked_up - 2.0 * both), 0.0), size = luminance(found);
    return found * max(1.0 - NOISE * (1.0 - error) * variance / max(size * size, 1e-30), 0.0);
}

// Stores the radiance at sample p, which stands for a cell of level l.
void store(ivec2 p, int l, vec3 value) {
    ivec2 cell = LEVELLED ? (p >> l) + ivec2(0, frame.levels[l].w) : p;
    if (LEVELLED && (l & 1) != 0) {
        imageStore(odd, cell, vec4(value, 1.0));
    } else {
        imageStore(radiance, cell, vec4(value, 1.0));
    }
}

void main() {
    uint index = list_index();
    if (index >= arguments.count) {
        return;
    }
    uint entry = list[ALLOCATED ? 2u * index : index];
    if (ALLOCATED) {
        split(list[2u * index + 1u]);
    } else {
        brdf_samples = push.brdf_samples;
        environment_samples = push.environment_samples;
        light_samples = push.light_samples;
    }
    ivec2 p = LEVELLED ? list_sample(entry) : ivec2(entry & 0xffffu, entry >> 16);
    int l = LEVELLED ? list_level(entry) : 0;
    place = p;
    uint before = 0u;
    ivec2 whose = p;
    if (SHARING != 0) {
        int finer = max(SHARING - l, 0);
        brdf_samples = share(brdf_samples, finer);
        environment_samples = share(environment_samples, finer);
        light_samples = share(light_samples, finer);
        before = turn(p, l, finer);
        whose = p >> SHARING;
    }
    vec3 ray = frame_ray(p);
    vec4 normal = texelFetch(normals, p, 0);
    Local f = local_frame(normal.xyz, -normalize(ray));
    vec3 at = frame.eye.xyz + ray * gbuffer_depth(p);
    Material m = material_load(gbuffer_material(p), f.view.z, tangent_turn(f, tangent_decode(normal.xyz, normal.w)),
        factors_unpack(texelFetch(factors, p, 0)));
    Surface s = Surface(f, m, lobes_load(p, f, m));

    uint seed = hash((uint(whose.y) << 16 | uint(whose.x)) ^ hash(frame.sampling.x ^ hash(frame.sampling.y)));
    vec3 sum = vec3(0.0);
    if (ESTIMATOR == ESTIMATOR_LOOKUP) {
        for (uint i = 0u; i < brdf_samples; ++i) {
            sum += lookup(s, hash(seed + i));
        }
        store(p, l, sum);
        return;
    }
    vec3 known = vec3(0.0);
    Approximation a;
    if (ESTIMATOR == ESTIMATOR_RESIDUAL) {
        a = approximation_load(m, s.lobes, f.view);
        if (approximation_error(a) <= push.negligible) {
            float nothing = 0.0;
            if (RATIO != 0u) {
                nothing = 1.0;
            }
            store(p, l, vec3(nothing));
            return;
        }
        approximate(m, s.lobes, a, f.view);
        known = texelFetch(base, p, 0).rgb;
    }
    Tally t = Tally(NOTHING, vec2(0.0), vec3(0.0), vec3(0.0));
    uvec2 seeds = sobol_seeds(seed);
    for (uint i = 0u; i < brdf_samples; ++i) {
        uint point = before * brdf_samples + i;
        tally(t, brdf_contribution(s, at, ESTIMATOR == ESTIMATOR_BRDF_RANDOM ? random_point(point, seed) : sobol_point(point, seeds)));
    }
    tally_kind(t, brdf_samples);
    if (ALONE == 0u) {
        seeds = sobol_seeds(seed + 1u);
        for (uint i = 0u; i < environment_samples; ++i) {
            tally(t, environment_contribution(s, sobol_point(before * environment_samples + i, seeds)));
        }
        tally_kind(t, environment_samples);
        for (uint k = 0u; LOCAL_LIGHTS && k < frame.lights.y; ++k) {
            seeds = sobol_seeds(seed + 2u + k);
            for (uint i = 0u; i < light_samples; ++i) {
                t.sum.lights += light_contribution(s, at, lights[frame.lights.x + k], sobol_point(before * light_samples + i, seeds));
            }
        }
    }
    sum = t.sum.whole - t.sum.looked_up + t.sum.lights;
    if (ESTIMATOR != ESTIMATOR_RESIDUAL) {
        if (LOCAL_LIGHTS) {
            sum += reflected_lights(f, m, s.lobes, at, p);
        }
    }
    if (RATIO != 0u) {
        vec3 direct = reflected_suns(f, m, s.lobes, a, approximating_sharpest);
        if (LOCAL_LIGHTS) {
            direct += reflected_lights(f, m, s.lobes, at, p);
        }
        sum = lacking(t, max(known - direct, 0.0), min(approximation_error(a), 1.0)) + t.sum.lights;
        known += push.offset;
        sum = max(sum + known, 0.0) / known;
    }
    store(p, l, sum);
}
