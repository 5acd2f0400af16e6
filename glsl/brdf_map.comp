#version 460
// The moments of each texel of one material: its lobe under the normals and the roughness that its maps have there (Xu et al. 2017,
// section 4), in the tangent frame. src/distribution/brdf_map.rs and effective.rs are the f64 twins.
#include "cover.glsl"
#include "moments.glsl"
#include "roughness.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
// FILTER_* of moments.glsl.
layout(constant_id = 0) const uint FILTER = 0u;
layout(set = 2, binding = 0) uniform sampler2DArray normals;   // x and y
layout(set = 2, binding = 1) uniform sampler2DArray roughness; // a value
layout(set = 2, binding = 2, rgba32f) uniform writeonly image2DArray moments;
layout(push_constant) uniform Push {
    int layer;            // of moments
    int normal_layer;     // below 0 for none
    int roughness_layer;  // below 0 for none
    uint lobes;           // LOBES_* of moments.glsl
    float spread;         // of the lobe without a map of roughness
    float rule;           // of the roughness map, and the greatest alpha that it gives
    float most;
};

// Mean normal as x, y, 1 - z.
vec3 mean_normal(ivec2 p, ivec2 size) {
    ivec2 from = textureSize(normals, 0).xy;
    Cover columns = cover(p.x, from.x, size.x), rows = cover(p.y, from.y, size.y);
    vec3 sum = vec3(0.0);
    for (int y = rows.first; y <= rows.last; ++y) {
        for (int x = columns.first; x <= columns.last; ++x) {
            vec2 xy = texelFetch(normals, ivec3(x, y, normal_layer), 0).xy;
            float square = dot(xy, xy), z = sqrt(max(1.0 - square, 0.0)), length = sqrt(square + z * z);
            vec3 n = vec3(xy, z) / length;
            sum += vec3(n.xy, dot(n.xy, n.xy) / (1.0 + n.z)) * (cover_share(columns, x, from.x, size.x) * cover_share(rows, y, from.y, size.y));
        }
    }
    return sum;
}

float mean_spread(ivec2 p, ivec2 size) {
    ivec2 from = textureSize(roughness, 0).xy;
    Cover columns = cover(p.x, from.x, size.x), rows = cover(p.y, from.y, size.y);
    float sum = 0.0;
    for (int y = rows.first; y <= rows.last; ++y) {
        for (int x = columns.first; x <= columns.last; ++x) {
            float alpha = alpha_by_rule(rule, texelFetch(roughness, ivec3(x, y, roughness_layer), 0).x, most);
            float of_lobe = lobes == LOBES_EXPONENT ? 0.5 * alpha * alpha : vmf_spread(2.0 / (alpha * alpha));
            sum += of_lobe * cover_share(columns, x, from.x, size.x) * cover_share(rows, y, from.y, size.y);
        }
    }
    return sum;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(moments).xy;
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    vec3 normal = normal_layer < 0 ? vec3(0.0) : mean_normal(p, size);
    float base = roughness_layer < 0 ? spread : mean_spread(p, size);
    // The lobe's mean direction, and its spread under those normals: means of directions multiply.
    float off = moments_spread(normal, 0.0), along = 1.0 - off;
    vec3 mu = vec3(normal.xy, normal.z - off) / along;
    float whole = off + along * base;
    vec4 stored;
    if (FILTER == FILTER_VMF1) {
        stored = vec4(mu.xy * (1.0 - whole), mu.z + (1.0 - mu.z) * whole, whole);
    } else {
        stored = vec4(mu, vmf_concentration(whole));
    }
    imageStore(moments, ivec3(p, layer), stored);
}
