#version 460
// What a surface is at the pixel's scale: the shading normal, factors on the reflectance's colours, its roughness and what the
// surface's own curvature adds to it. Filter `point`: colours through their mips by the footprint, normals and roughness from
// the base level; `tk` adds the kernel of the interpolated normals' derivatives; the others read normals and concentrations as
// moments, through mips too. src/material.rs and src/moments.rs are the f64 twins.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "tangent.glsl"
#include "factors.glsl"
#include "moments.glsl"
#include "roughness.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Classes in which there are maps of a kind, one bit each: others are compiled away.
layout(constant_id = 0) const uint ALBEDO_CLASSES = 0u;
layout(constant_id = 1) const uint SPECULAR_CLASSES = 0u;
layout(constant_id = 2) const uint NORMAL_CLASSES = 0u;
layout(constant_id = 3) const uint ROUGHNESS_CLASSES = 0u;
// Whether the mesh's curvature within the pixel widens lobes.
layout(constant_id = 4) const bool GEOMETRIC = false;
// Classes of moments, and what of a texel's makes its lobe: FILTER_* of moments.glsl.
layout(constant_id = 5) const uint MOMENT_CLASSES = 0u;
layout(constant_id = 6) const uint FILTER = 0u;

struct MapRecord {
    uvec4 places;  // albedo, specular, normal, roughness: 0 for none, else (layer << 3 | class) + 1
    vec2 tiling;   // factors on uv
    vec2 rule;     // of the roughness map; the greatest alpha that it gives
    float without; // albedo factor without an albedo map
    uint moments;  // as `places`
    uint lobes;    // LOBES_* of moments.glsl
    uint unused;
};
layout(set = 2, binding = 1, std430) readonly buffer Maps {
    MapRecord maps[]; // by material
};
layout(set = 2, binding = 2) uniform sampler2DArray textures_0;
layout(set = 2, binding = 3) uniform sampler2DArray textures_1;
layout(set = 2, binding = 4) uniform sampler2DArray textures_2;
layout(set = 2, binding = 5) uniform sampler2DArray textures_3;
layout(set = 2, binding = 6) uniform sampler2DArray textures_4;
layout(set = 2, binding = 7) uniform sampler2DArray textures_5;
layout(set = 2, binding = 8) uniform sampler2DArray textures_6;
layout(set = 2, binding = 9) uniform sampler2DArray textures_7;
layout(set = 2, binding = 10, rgba32f) uniform writeonly image2D normals;   // shading normal; tangent as tangent.glsl encodes it
layout(set = 2, binding = 11, rgba32ui) uniform writeonly uimage2D factors; // as factors.glsl packs them

// The level whose texels are as large as the longer derivative.
float level(sampler2DArray t, vec4 footprint) {
    vec2 size = vec2(textureSize(t, 0).xy);
    vec2 x = footprint.xy * size, y = footprint.zw * size;
    return 0.5 * log2(max(max(dot(x, x), dot(y, y)), 1.0));
}

// A map's value; `base` looks it up in level 0. Textures count rows from the top, coordinates upwards.
#define LOOK_UP(i) \
    if ((classes & (1u << i)) != 0u) { \
        vec4 fetched = textureLod(textures_##i, at, base ? 0.0 : level(textures_##i, footprint)); \
        value = place.x == float(i) ? fetched : value; \
    }
vec4 look_up(uint classes, uint code, vec2 uv, vec4 footprint, bool base, vec4 without) {
    int slot = int(code) - 1;
    vec2 place = vec2(slot < 0 ? -1 : (slot & 7), max(slot >> 3, 0));
    vec3 at = slot < 0 ? vec3(0.0) : vec3(uv.x, 1.0 - uv.y, place.y);
    vec4 value = without;
    LOOK_UP(0)
    LOOK_UP(1)
    LOOK_UP(2)
    LOOK_UP(3)
    LOOK_UP(4)
    LOOK_UP(5)
    LOOK_UP(6)
    LOOK_UP(7)
    return value;
}

// Isotropic filtering of normal distributions by the derivatives of interpolated normals (Tokuyoshi and Kaplanyan 2021,
// "Stable geometric specular antialiasing with projected-space NDF filtering", listing 5): twice the variance of the normal
// within a pixel filter of variance 1/(2 pi), at most 0.18.
const float FILTER_VARIANCE = 0.5 * INV_PI;
const float MOST_KERNEL = 0.18;

// The normal's change over one sample along an axis: central where both neighbours are of the same surface.
vec3 normal_change(ivec2 p, ivec2 axis, vec3 n, float depth, uint object, float reach) {
    vec3 sum = vec3(0.0);
    float steps = 0.0;
    for (int side = -1; side <= 1; side += 2) {
        ivec2 q = p + axis * side;
        bool inside = all(greaterThanEqual(q, ivec2(0))) && all(lessThan(q, ivec2(frame.extent.xy)));
        q = inside ? q : p;
        bool same = inside && gbuffer_covered(q) && gbuffer_object(q) == object && abs(gbuffer_depth(q) - depth) <= reach;
        sum += same ? (gbuffer_normal(q) - n) * float(side) : vec3(0.0);
        steps += same ? 1.0 : 0.0;
    }
    return sum / max(steps, 1.0);
}

float geometric_kernel(ivec2 p, vec3 n) {
    float depth = gbuffer_depth(p);
    uint object = gbuffer_object(p);
    // As far as a plane of this tilt changes in depth over a few samples.
    float facing = max(abs(dot(n, normalize(frame_ray(p)))), 0.02);
    float footprint = depth * max(abs(frame.ray.x) * 2.0 / float(frame.extent.x), abs(frame.ray.y) * 2.0 / float(frame.extent.y));
    float reach = 4.0 * footprint / facing;
    vec3 x = normal_change(p, ivec2(1, 0), n, depth, object, reach);
    vec3 y = normal_change(p, ivec2(0, 1), n, depth, object, reach);
    return min(2.0 * FILTER_VARIANCE * (dot(x, x) + dot(y, y)), MOST_KERNEL);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(p), frame.extent.xy)) || !gbuffer_covered(p)) {
        return;
    }
    MapRecord record = maps[gbuffer_material(p)];
    vec2 uv = gbuffer_uv(p) * record.tiling;
    vec4 footprint = gbuffer_footprint(p) * record.tiling.xyxy;
    vec3 n = gbuffer_normal(p);
    vec4 t = gbuffer_tangent(p);

    Factors f;
    f.albedo = look_up(ALBEDO_CLASSES, record.places.x, uv, footprint, false, vec4(record.without)).rgb;
    f.specular = look_up(SPECULAR_CLASSES, record.places.y, uv, footprint, false, vec4(1.0)).rgb;
    f.alpha = NO_ALPHA;
    if (ROUGHNESS_CLASSES != 0u) {
        float v = look_up(ROUGHNESS_CLASSES, record.places.w, uv, footprint, true, vec4(1.0)).x;
        f.alpha = record.places.w != 0u ? alpha_by_rule(record.rule.x, v, record.rule.y) : NO_ALPHA;
    }
    f.kernel = 0.0;
    if (GEOMETRIC) {
        f.kernel = geometric_kernel(p, n);
    }
    if (NORMAL_CLASSES != 0u) {
        vec2 xy = look_up(NORMAL_CLASSES, record.places.z, uv, footprint, true, vec4(0.0)).xy;
        vec3 local = vec3(xy, sqrt(max(1.0 - dot(xy, xy), 0.0)));
        vec3 bent = normalize(t.xyz * local.x + cross(n, t.xyz) * (t.w * local.y) + n * local.z);
        n = record.places.z != 0u && t.w != 0.0 ? bent : n;
    }
    if (MOMENT_CLASSES != 0u) {
        vec4 moments = look_up(MOMENT_CLASSES, record.moments, uv, footprint, false, vec4(0.0));
        if (FILTER == FILTER_FIXED) {
            // The map's mean: its last level.
            moments.w = look_up(MOMENT_CLASSES, record.moments, uv, vec4(1e4), false, vec4(0.0)).w;
        }
        float alpha = clamp(moments_alpha(FILTER, moments, record.lobes), LEAST_ALPHA, record.rule.y);
        f.alpha = record.moments != 0u && record.lobes != LOBES_STAY ? alpha : f.alpha;
        vec3 local = normalize(vec3(moments.xy, 1.0 - moments.z));
        vec3 bent = normalize(t.xyz * local.x + cross(n, t.xyz) * (t.w * local.y) + n * local.z);
        n = record.moments != 0u && t.w != 0.0 ? bent : n;
    }
    imageStore(normals, p, vec4(n, tangent_encode(n, t.xyz, t.w)));
    imageStore(factors, p, factors_pack(f));
}
