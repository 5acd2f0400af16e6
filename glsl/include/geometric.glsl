// How far the mesh's curvature within a pixel widens lobes. Include after frame.glsl and gbuffer.glsl.
#ifndef GEOMETRIC_GLSL
#define GEOMETRIC_GLSL
#include "angles.glsl"

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

#endif
