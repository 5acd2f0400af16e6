// Clusters of lobes in the stereographic plane, and the moments of a texel's lobes in each (src/distribution/clusters.rs is the f64
// twin). The includer defines CLUSTERS_BINDING.
#ifndef CLUSTERS_GLSL
#define CLUSTERS_GLSL
#include "moments.glsl"
#include "stereographic.glsl"

const uint MOST_CLUSTERS = 8u;
const uint MOST_COLOURED = 4u;

// Lengths are stored this many times as long, squares by its square: numbers of 16 bits would lose the variance of sharp lobes.
const float CLUSTER_LENGTH = 16.0;

const float CLUSTER_OUTSIDE = 1e6;

struct Cluster {
    vec4 at;    // centre; constant; the least variance of a lobe
    vec4 shape; // the inverse matrix of distances: xx, xy, yy; which variances of lobes it takes
    vec4 own;   // the mean of these
};
layout(set = 2, binding = CLUSTERS_BINDING, std430) readonly buffer Clusters {
    Cluster clusters[];
};

// The layer of the colour of the ith of `all`, behind those of moments.
uint clusters_colour(uint i, uint all, uint upright) {
    return all + (upright != 0u ? (all + 1u) / 2u : all) + i;
}

// The one of `count` from `first` on that takes a lobe at s with the variance `own` = 1 / kappa.
uint cluster_of(uint first, uint count, vec2 s, float own) {
    uint nearest = 0u;
    float least = 3e38;
    for (uint i = 0u; i < count; ++i) {
        Cluster c = clusters[first + i];
        vec2 d = s - c.at.xy;
        bool inside = c.shape.w < 0.0 ? own < -c.shape.w : own >= c.shape.w;
        float off = c.at.z + c.shape.x * d.x * d.x + 2.0 * c.shape.y * d.x * d.y + c.shape.z * d.y * d.y;
        off += inside ? 0.0 : CLUSTER_OUTSIDE;
        nearest = off < least ? i : nearest;
        least = min(off, least);
    }
    return nearest;
}

// A lobe as it is added to its cluster.
struct Placed {
    uint cluster;
    vec4 first; // mass; place from the centre; mean product xx
    vec2 second; // xy, yy
};

// Of a lobe about mu, which is stored as x, y, 1 - z; `weight` over its mean cosine is its mass.
Placed cluster_place(uint first, uint count, vec3 mu, float kappa, float weight, uint lobes) {
    vec2 s = stereographic_of(mu);
    float own = 1.0 / max(kappa, 0.25), scale = stereographic_scale(s);
    Placed p;
    p.cluster = cluster_of(first, count, s, own);
    vec2 d = (s - clusters[first + p.cluster].at.xy) * CLUSTER_LENGTH;
    float variance = own * scale * scale * (CLUSTER_LENGTH * CLUSTER_LENGTH), q = weight / moments_area(kappa, lobes);
    p.first = q * vec4(1.0, d, d.x * d.x + variance);
    p.second = q * vec2(d.x * d.y, d.y * d.y + variance);
    return p;
}

// An elliptic lobe of the tangent frame.
struct Ellipse {
    vec3 mu; // stored as x, y, 1 - z
    vec3 axis;
    float kappa;
    float ratio;
};

Ellipse cluster_decode(Cluster c, vec4 first, vec2 second) {
    vec2 off = first.yz / first.x;
    vec3 matrix = vec3(first.w, second) / first.x - vec3(off.x * off.x, off.x * off.y, off.y * off.y);
    matrix *= 1.0 / (CLUSTER_LENGTH * CLUSTER_LENGTH);
    float mean = 0.5 * (matrix.x + matrix.z), half_of = 0.5 * (matrix.x - matrix.z);
    float apart = sqrt(half_of * half_of + matrix.y * matrix.y);
    float wide = max(mean + apart, c.at.w), narrow = max(mean - apart, c.at.w);
    float cosine = apart > 0.0 ? half_of / apart : 1.0;
    vec2 along = sqrt(0.5 * max(vec2(1.0 + cosine, 1.0 - cosine), 0.0)) * vec2(1.0, matrix.y < 0.0 ? -1.0 : 1.0);
    vec2 s = c.at.xy + off * (1.0 / CLUSTER_LENGTH);
    float scale = stereographic_scale(s);
    return Ellipse(stereographic_direction(s), stereographic_tangent(s, along), scale * scale * inversesqrt(wide * narrow), sqrt(wide / narrow));
}

#endif
