#version 460
// The moments of each texel of one material: its lobes under the normals and the roughness that its maps have there (Xu et al. 2017,
// section 4), in the tangent frame. src/distribution/brdf_map.rs and effective.rs are the f64 twins.
#include "cover.glsl"
#include "moments.glsl"
#include "roughness.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
// FILTER_* of moments.glsl.
layout(constant_id = 0) const uint FILTER = 0u;
// How lobes and normals make one: by mean vectors (0), or by equations 13 and 14, which are for small angles, with its length by
// equation 9 (1) or by the table (2).
layout(constant_id = 1) const uint RULE = 0u;
layout(set = 2, binding = 0) uniform sampler2DArray normals;   // x and y
layout(set = 2, binding = 1) uniform sampler2DArray roughness; // a value
layout(set = 2, binding = 2) uniform sampler2DArray colours;   // specular
layout(set = 2, binding = 3, rgba32f) uniform writeonly image2DArray moments;
layout(set = 2, binding = 4, std430) readonly buffer Spreads {
    float spreads[]; // src/distribution/literal.rs, SpreadTable
};
layout(push_constant) uniform Push {
    vec4 base[MOST_BASE_LOBES]; // lobes about the normal: mean direction; spread without a map of roughness
    vec4 weights;
    uint count;
    uint lobes;           // LOBES_* of moments.glsl
    int layer;            // first of moments
    int normal_layer;     // below 0 for none
    int roughness_layer;  // below 0 for none
    int colour_layer;     // below 0 for none
    float rule;           // of the roughness map, and the greatest alpha that it gives
    float most;
    uint upright;         // whether all lobes are about the normal
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

vec3 mean_colour(ivec2 p, ivec2 size) {
    ivec2 from = textureSize(colours, 0).xy;
    Cover columns = cover(p.x, from.x, size.x), rows = cover(p.y, from.y, size.y);
    vec3 sum = vec3(0.0);
    for (int y = rows.first; y <= rows.last; ++y) {
        for (int x = columns.first; x <= columns.last; ++x) {
            float share = cover_share(columns, x, from.x, size.x) * cover_share(rows, y, from.y, size.y);
            sum += texelFetch(colours, ivec3(x, y, colour_layer), 0).rgb * share;
        }
    }
    return sum;
}

// What is stored of a lobe with mean direction mu, stored as x, y, 1 - z: two layers of slopes, else one.
void encode(vec3 mu, float spread, out vec4 first, out vec4 second) {
    second = vec4(0.0);
    if (filter_of_slopes(FILTER)) {
        vec2 b = slope_of(vec3(mu.xy, 1.0 - mu.z));
        vec3 products = slope_products(b, vmf_concentration(spread), FILTER == FILTER_LEAN_LOBE);
        first = vec4(b, products.xz);
        second.x = products.y;
    } else if (FILTER == FILTER_VMF1 || filter_of_cells(FILTER)) {
        first = vec4(mu.xy * (1.0 - spread), mu.z + (1.0 - mu.z) * spread, spread);
    } else {
        first = vec4(mu, vmf_concentration(spread));
    }
}

const float LOG_MOST_TABULATED = 11.090370; // log(1 + MOST_TABULATED) of src/distribution/literal.rs

// The spread of a lobe, from the table: even in the logarithm of 1 + kappa, linear between entries.
float tabulated_spread(float kappa) {
    int last = spreads.length() - 1;
    float at = clamp(log(1.0 + kappa) / LOG_MOST_TABULATED, 0.0, 1.0) * float(last);
    int first = min(int(at), last - 1);
    return mix(spreads[first], spreads[first + 1], at - float(first));
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(moments).xy;
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    vec3 normal = normal_layer < 0 ? vec3(0.0) : mean_normal(p, size);
    float off = moments_spread(normal, 0.0), along = 1.0 - off;
    vec3 mean = vec3(normal.xy, normal.z - off) / along;
    vec3 z = vec3(mean.xy, 1.0 - mean.z), x = vec3(1.0, 0.0, 0.0) - z * z.x;
    float across = dot(x, x);
    x = across > 1e-12 ? x * inversesqrt(across) : vec3(0.0, 0.0, -1.0);
    vec3 y = cross(z, x);

    int next = layer;
    if (upright == 0u) {
        imageStore(moments, ivec3(p, next++), vec4(mean, 0.0));
    }
    float of_map = roughness_layer < 0 ? 0.0 : mean_spread(p, size);
    vec4 first = vec4(0.0), second = vec4(0.0);
    for (uint i = 0u; i < count; ++i) {
        // A lobe's mean vector under those normals is along times as long along their mean, (1 + along) / 2 times across it.
        vec3 mu = base[i].xyz;
        float square = mu.z * mu.z;
        float missing = (1.0 - square) * (off - 0.25 * off * off) + square * (2.0 * off - off * off); // 1 - length^2
        float lost = missing / (1.0 + sqrt(1.0 - missing)), kept = 1.0 - lost;
        vec3 turned = mean;
        if (upright == 0u) {
            vec3 local = mu * vec3(vec2(1.0 - 0.5 * off), along) / kept;
            turned = x * local.x + y * local.y + z * local.z;
            turned.z = 1.0 - turned.z;
        }
        float own = roughness_layer < 0 ? base[i].w : of_map;
        float spread = lost + kept * own;
        if (RULE != 0u) {
            float kappa = vmf_concentration(own), exponent = max(kappa - 1.0, 0.0), of_normals = vmf_literal_concentration(off);
            float both = 1.0 + (off < VMF_LEAST_SPREAD ? exponent : of_normals * exponent / (of_normals + exponent));
            if (RULE == 2u) {
                spread = tabulated_spread(both);
            } else {
                spread = vmf_literal_spread(both);
            }
        }
        vec4 a, b;
        encode(turned, spread, a, b);
        float weight = filter_merges(FILTER) ? weights[i] : 1.0;
        first += a * weight;
        second += b * weight;
        if (!filter_merges(FILTER) || i + 1u == count) {
            imageStore(moments, ivec3(p, next++), first);
            if (filter_of_slopes(FILTER)) {
                imageStore(moments, ivec3(p, next++), second);
            }
            first = vec4(0.0);
            second = vec4(0.0);
        }
    }
    if (colour_layer >= 0) {
        imageStore(moments, ivec3(p, next), vec4(mean_colour(p, size), 0.0));
    }
}
