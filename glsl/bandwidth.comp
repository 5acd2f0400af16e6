#version 460
// Image bandwidth and level of every block of samples (Bagher 2011, sections 2.1 to 2.3, equations 3, 4 and 9, as corrected in
// src/frequency): a few directions drawn from the reflectance tell how fast light and lobe vary where light comes from, the
// surface's curvature and distance how fast that makes the image vary. One sample stands for a block of 2x2 output pixels. Where the
// filter finds lobes, these are the reflectance: what a pixel covers varies less than what its texels do.
layout(set = 2, binding = 3) uniform sampler2D normals;  // as the filter pass writes them
layout(constant_id = 2) const bool KERNEL = false;
#define MATERIAL_KERNEL KERNEL
#include "frame.glsl"
#include "gbuffer.glsl"
#include "luminance.glsl"
#include "materials.glsl"
#include "local.glsl"
#include "environment.glsl"
#include "lights.glsl"
#define SHADOWS_BINDING 13
#include "shadows.glsl"
#define LOBES_BINDING 14
#include "lobes.glsl"
#include "curvature.glsl"
#include "bandwidth.glsl"
#include "lobe_bandwidth.glsl"
#include "forecast.glsl"
#include "list.glsl"
#include "texture_bandwidth.glsl"
#include "allocation.glsl"

layout(local_size_x = LIST_GROUP) in;

layout(constant_id = 0) const int OPERATOR = OPERATOR_CLIPPED;
// How the probes' bandwidths are combined, in the order of src/frequency/operators.rs.
layout(constant_id = 1) const int COMBINE = 0;
const int COMBINE_MEAN = 0;
const int COMBINE_MAX = 1;
const int COMBINE_LITERAL = 2;
// Whether the frame has lights beside the environment.
layout(constant_id = 3) const bool LOCAL_LIGHTS = false;
// What directions are shared out by, in the order of src/frequency/allocation.rs.
layout(constant_id = 4) const int ALLOCATION = ALLOCATION_CONSTANT;
// Where the filter finds lobes: whether there are materials beside, which stay as they are.
layout(constant_id = 10) const uint UNFILTERED = 1u;
#include "surface.glsl"
#include "found_bandwidth.glsl"

layout(set = 2, binding = 4) uniform usampler2D factors;
layout(set = 2, binding = 5) uniform sampler2D environment_bandwidth; // cycles/radian
layout(set = 2, binding = 6) uniform sampler2D lobe_bandwidths;       // cycles/radian
layout(set = 2, binding = 7, r32ui) uniform writeonly uimage2D level; // of each sample, in levels over a sample
layout(set = 2, binding = 8, rgba16f) uniform writeonly image2D prediction; // of each block: cycles/sample; standard deviation of the
                                                                           // integrand over its mean; logarithm of the weight
                                                                           // by which directions are shared out; 1
layout(set = 2, binding = 9, std430) readonly buffer Lights {
    LightRecord lights[]; // exact ones first
};

layout(set = 2, binding = 10, std430) buffer Found {
    Forecast forecast;
};
layout(set = 2, binding = 11, std430) readonly buffer Blocks {
    uint blocks[]; // as block_entry packs them
};

layout(set = 2, binding = 12, std430) readonly buffer TextureBandwidths {
    float texture_bandwidths[]; // cycles per unit of the surface's coordinates
};

layout(push_constant) uniform Push {
    int side;                // of a block, in samples
    int probes;
    float samples_per_cycle;
    int coarsest;            // level
    uint early;              // 1 to forecast from the blocks that are looked at first, writing nothing else
    uint all;                // where the list of all blocks begins
    float dark;              // radiance that is added to the mean where noise is weighed against it
} push;

// Where more than this share of the samples is forecast, all of them are shaded: up-sampling shades a few per cent more than is
// forecast, and what finds the others takes about 8 % of a frame at 64 directions.
const float FALLBACK = 0.85;

shared uint group_shaded;
shared uint group_covered;

// Frequencies are finite: a light without extent varies faster than anything.
const float SHARPEST = 1e6;

// Sums over the probes of a block.
struct Sums {
    float weighted;  // bandwidth times weight, which has no density in equation 4 to the letter
    float weights;
    float radiance;
    float greatest;
    float squares;   // of the weights
    float bound;     // equation 8's, on the variance
};

// What a direction reflects, and one over the density that it was drawn with.
void add(inout Sums s, float bandwidth, float radiance, float reflected, float per_density) {
    float weight = radiance * reflected * per_density;
    s.weighted += bandwidth * (COMBINE == COMBINE_LITERAL ? radiance * reflected : weight);
    s.weights += weight;
    s.radiance += radiance;
    s.greatest = max(s.greatest, weight > 0.0 ? bandwidth : 0.0);
    s.squares += weight * weight;
}

// Of light from local wi above the horizon, h the half vector.
struct Reflected {
    float luminance; // reflectance times the cosine
    float lobe;      // how fast it varies about wi, in cycles/radian
    float density;   // per steradian, with which lobes are drawn from
};

// `id` is of the surface's material.
Reflected reflected(Surface s, uint id, vec3 wi, vec3 h) {
    Reflected r = Reflected(0.0, 0.0, 0.0);
    vec3 wo = s.frame.view;
    if (UNFILTERED != 0u) {
        r.luminance = luminance(material_evaluate(s.material, wi, wo, h)) * wi.z;
        r.lobe = texelFetch(lobe_bandwidths, lobe_bandwidth_texel(int(id), wi, wo), 0).x * s.material.sharpness;
    }
    if (LOBED != 0u) {
        vec4 value = lobes_evaluate(s.material, s.lobes, wi, wo, h);
        float found = found_bandwidth(s.material, s.lobes, wi, wo);
        bool these = lobed(s);
        r = Reflected(these ? luminance(value.rgb) : r.luminance, these ? found : r.lobe, value.a);
    }
    return r;
}

// Level of the samples of a block, which it writes unless it forecasts.
int predict(uint entry) {
    ivec2 block = block_place(entry), first = block * push.side, extent = ivec2(frame.extent.xy);
    int k = block_sample(entry);
    ivec2 at = first + ivec2(k % push.side, k / push.side);
    Place c = place_at(at);
    vec4 normal = texelFetch(normals, at, 0);
    float ray_length = length(c.ray);
    Local f = local_frame(normal.xyz, -c.ray / ray_length);
    vec3 point = frame.eye.xyz + c.ray * c.depth;
    uint id = gbuffer_material(at);
    Factors adjusted = factors_unpack(texelFetch(factors, at, 0));
    Material m = material_load(id, f.view.z, tangent_turn(f, tangent_decode(normal.xyz, normal.w)), adjusted);
    Surface s = Surface(f, m, lobes_load(at, f, m));

    vec2 curvatures = principal_curvatures(c);
    float distance = c.depth * ray_length;
    // Of the image plane at distance 1, whose rays have length 1 along the view axis.
    vec2 plane = ((vec2(at) + 0.5) / vec2(extent) * 2.0 - 1.0) * frame.ray.xy + frame.ray.zw;
    float angle = pixel_angle(plane, abs(frame.ray.xy) * 2.0 / vec2(extent));

    Sums sums = Sums(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    uvec2 seeds = sobol_seeds(hash(uint(block.y) << 16 | uint(block.x)) ^ frame.sampling.x);
    for (int i = 0; i < push.probes; ++i) {
        Drawn d = surface_sample(s, sobol_point(uint(i), seeds));
        bool above = d.wi.z > 0.0;
        vec3 wi = above ? d.wi : vec3(0.0, 0.0, 1.0), h = above ? d.h : normalize(f.view + wi);
        vec2 uv = latlong_uv(to_world(f, wi));
        uv.x -= frame.environment.x;
        float radiance = luminance(environment_fetch(uv).rgb);
        Reflected r = reflected(s, id, wi, h);
        // In directions that are not drawn the density may be 0.
        float per_density = above ? 1.0 / max(d.density > 0.0 ? d.density : r.density, 1e-30) : 0.0;
        float light = textureLod(environment_bandwidth, uv, 0.0).x;
        float b = image_bandwidth(OPERATOR, light, r.lobe, curvatures, distance, f.view.z, angle);
        add(sums, b, above ? radiance : 0.0, above ? r.luminance : 0.0, per_density);
        float product = radiance * r.luminance / wi.z;
        sums.bound += above ? (light + r.lobe) * product * product : 0.0;
    }
    float mean = sums.weights / float(push.probes);
    float variance = max(sums.squares / float(push.probes) - mean * mean, 0.0);

    // Lights beside the environment: without extent, which is the safe side for those that have some. From one nearby, light
    // turns along the surface as from a distant one where the surface is curved by half of cos / distance more.
    for (uint i = 0u; LOCAL_LIGHTS && i < frame.lights.x + frame.lights.y; ++i) {
        bool exact = i < frame.lights.x;
        vec4 w = exact ? light_exact(lights[i], point) : vec4(normalize(lights[i].place.xyz - point), 1.0);
        vec3 wi = vec3(dot(w.xyz, f.x), dot(w.xyz, f.y), dot(w.xyz, f.z));
        bool above = wi.z > 0.0;
        wi = above ? wi : vec3(0.0, 0.0, 1.0);
        vec3 h = normalize(wi + f.view);
        float solid = exact ? w.w : 1.0 / max(light_density(lights[i], point, w.xyz), 1e-6);
        float radiance = luminance(shadowed(lights[i], at)) * solid;
        bool distant = exact && lights[i].place.w == LIGHT_DIRECTIONAL;
        float nearness = distant ? 0.0 : 1.0 / max(length(lights[i].place.xyz - point), 1e-6);
        Reflected r = reflected(s, id, wi, h);
        float b = image_bandwidth(OPERATOR, SHARPEST, r.lobe, curvatures + 0.5 * wi.z * nearness, distance, f.view.z, angle);
        add(sums, b, above ? radiance : 0.0, above ? r.luminance : 0.0, float(push.probes));
    }

    float total = COMBINE == COMBINE_MEAN ? sums.weights : sums.radiance;
    float b = COMBINE == COMBINE_MAX ? sums.greatest : (total > 0.0 ? sums.weighted / total : 0.0);
    // Textures vary over the surface: their mips leave at most half a cycle a sample.
    vec4 footprint = gbuffer_footprint(at);
    float texture_units = sqrt(max(dot(footprint.xy, footprint.xy), dot(footprint.zw, footprint.zw)));
    vec3 textures = m.record.texture_bandwidth.xyz;
    int cell = texture_cell(int(textures.x), gbuffer_uv(at) * textures.yz, texture_units * max(textures.y, textures.z));
    b += min(texture_bandwidths[cell] * texture_units, 0.5);
    int found = bandwidth_level(b, push.samples_per_cycle, 0, push.coarsest);
    if (push.early == 1u) {
        return found;
    }
    float weight = ALLOCATION == ALLOCATION_EQUATION8 ? sums.bound : sqrt(variance);
    if (ALLOCATION == ALLOCATION_RELATIVE) {
        float chance = ALLOCATION_CHANCE * mean;
        weight = mean > 0.0 ? sqrt(variance + chance * chance) / (sums.weights / float(push.probes) + push.dark) : 0.0;
    }
    float log_weight = ALLOCATION == ALLOCATION_CONSTANT ? 0.0 : allocation_log(weight);
    imageStore(prediction, block, vec4(min(b, 6e4), min(mean > 0.0 ? sqrt(variance) / mean : 0.0, 6e4), log_weight, 1.0));
    for (k = 0; k < push.side * push.side; ++k) {
        ivec2 p = first + ivec2(k % push.side, k / push.side);
        if (all(lessThan(p, extent))) {
            // Another object in the block is shaded once a pixel, or as finely as its edges need.
            bool same = !gbuffer_covered(p) || gbuffer_object(p) == c.object;
            uint finest = uint(same ? found : min(found, findMSB(push.side) - 1));
            imageStore(level, p, uvec4(LOCAL_LIGHTS ? shadow_level(p, finest) : finest));
        }
    }
    return found;
}

// The last group to come here turns off either the list of all samples or what finds coarser ones; directions that are shared out
// by weights are so in both.
void decide() {
    memoryBarrierBuffer();
    if (atomicAdd(forecast.groups, 1u) + 1u < gl_NumWorkGroups.x * gl_NumWorkGroups.y) {
        return;
    }
    float shaded = float(atomicAdd(forecast.shaded, 0u)) / 64.0, covered = float(atomicAdd(forecast.covered, 0u));
    if (shaded > FALLBACK * covered) {
        forecast.blocks_x = ALLOCATION == ALLOCATION_CONSTANT ? 0u : forecast.blocks_x;
        forecast.cells_x = 0u;
        forecast.samples_x = STRIPE;
    }
}

void main() {
    if (gl_LocalInvocationIndex == 0u) {
        group_shaded = 0u;
        group_covered = 0u;
    }
    barrier();
    bool early = push.early == 1u;
    uint index = list_index(), count = early ? forecast.first : forecast.blocks;
    int found = index < count ? predict(blocks[index + (early ? 0u : push.all)]) : -1;
    if (early && found >= 0) {
        atomicAdd(group_shaded, max(64u >> (2 * found), 1u));
        atomicAdd(group_covered, 1u);
    }
    barrier();
    if (early && gl_LocalInvocationIndex == 0u) {
        atomicAdd(forecast.shaded, group_shaded);
        atomicAdd(forecast.covered, group_covered);
        decide();
    }
}
