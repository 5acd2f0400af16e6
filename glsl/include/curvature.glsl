// Principal curvatures by the shape operator B A^-1, A = [P_x P_y] and B = [N_x N_y] in the tangent plane, from differences
// between neighbours of the same object (Bagher 2011, section 2.1 asks for the curvature of the surface). The including pass
// declares `normals` as the filter writes them.
#ifndef CURVATURE_GLSL
#define CURVATURE_GLSL
#include "frame.glsl"
#include "gbuffer.glsl"

// What a sample shows of one surface.
struct Place {
    ivec2 p;
    uint object;
    float depth;
    vec3 n;
    vec3 ray;
};

Place place_at(ivec2 p) {
    return Place(p, gbuffer_object(p), gbuffer_depth(p), texelFetch(normals, p, 0).xyz, frame_ray(p));
}

// Differences of position and normal along one screen axis: central where both neighbours belong to the surface.
bool differences(Place c, ivec2 axis, float reach, out vec3 dp, out vec3 dn) {
    vec3 point = c.ray * c.depth;
    vec3 points[2] = vec3[2](point, point), turned[2] = vec3[2](c.n, c.n);
    bool found = false;
    for (int k = 0; k < 2; ++k) {
        ivec2 q = c.p + (k == 0 ? axis : -axis);
        bool inside = all(greaterThanEqual(q, ivec2(0))) && all(lessThan(q, ivec2(frame.extent.xy)));
        q = inside ? q : c.p;
        float depth = gbuffer_depth(q);
        bool usable = inside && gbuffer_covered(q) && gbuffer_object(q) == c.object && abs(depth - c.depth) <= reach;
        points[k] = usable ? frame_ray(q) * depth : point;
        turned[k] = usable ? texelFetch(normals, q, 0).xyz : c.n;
        found = found || usable;
    }
    dp = points[0] - points[1];
    dn = turned[0] - turned[1];
    return found;
}

// k1, k2 in 1/m, |k1| >= |k2|; positive is convex. As curved as a sample can show where there is no neighbour on the surface,
// which asks for the finest shading.
vec2 principal_curvatures(Place c) {
    float facing = max(abs(dot(c.n, normalize(c.ray))), 0.02);
    float footprint = c.depth * max(abs(frame.ray.x) * 2.0 / float(frame.extent.x), abs(frame.ray.y) * 2.0 / float(frame.extent.y));
    float reach = 4.0 * footprint / facing;
    vec3 px, py, nx, ny;
    bool found = differences(c, ivec2(1, 0), reach, px, nx);
    found = differences(c, ivec2(0, 1), reach, py, ny) && found;
    vec3 t = normalize(abs(c.n.z) < 0.7 ? cross(c.n, vec3(0.0, 0.0, 1.0)) : cross(c.n, vec3(1.0, 0.0, 0.0)));
    vec3 b = cross(c.n, t);
    mat2 a = mat2(dot(px, t), dot(px, b), dot(py, t), dot(py, b));
    float area = determinant(a);
    vec2 k = vec2(1.0 / footprint);
    if (found && abs(area) > 1e-4 * footprint * footprint) {
        mat2 s = mat2(dot(nx, t), dot(nx, b), dot(ny, t), dot(ny, b)) * inverse(a);
        float mean = 0.5 * (s[0][0] + s[1][1]);
        float off = 0.5 * (s[0][1] + s[1][0]);
        float spread = length(vec2(0.5 * (s[0][0] - s[1][1]), off));
        k = mean >= 0.0 ? vec2(mean + spread, mean - spread) : vec2(mean - spread, mean + spread);
    }
    return k;
}

#endif
