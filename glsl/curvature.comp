#version 460
// Principal curvatures by the shape operator B A^-1, A = [P_x P_y] and B = [N_x N_y] in the tangent plane, from
// differences between neighbours of the same object (Bagher 2011, section 2.1 asks for the curvature of the surface).
#include "frame.glsl"
#include "gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 1, rgba16f) uniform writeonly image2D curvature; // k1, k2 in 1/m, |k1| >= |k2|; positive is convex

layout(set = 2, binding = 2) uniform sampler2D normals; // as the filter pass writes them

const float LARGEST = 6e4; // 16-bit float

vec3 normal(ivec2 p) {
    return texelFetch(normals, p, 0).xyz;
}

vec3 position(ivec2 p) {
    return frame_ray(p) * gbuffer_depth(p);
}

bool usable(ivec2 q, uint object, float depth, float reach) {
    return all(greaterThanEqual(q, ivec2(0))) && all(lessThan(q, ivec2(frame.extent.xy))) && gbuffer_covered(q)
        && gbuffer_object(q) == object && abs(gbuffer_depth(q) - depth) <= reach;
}

// Differences of position and normal along one screen axis: central where both neighbours belong to the surface.
bool differences(ivec2 p, ivec2 axis, uint object, float depth, float reach, out vec3 dp, out vec3 dn) {
    bool after = usable(p + axis, object, depth, reach), before = usable(p - axis, object, depth, reach);
    ivec2 a = after ? p + axis : p, b = before ? p - axis : p;
    dp = position(a) - position(b);
    dn = normal(a) - normal(b);
    return after || before;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(p), frame.extent.xy))) {
        return;
    }
    if (!gbuffer_covered(p)) {
        imageStore(curvature, p, vec4(0.0));
        return;
    }
    uint object = gbuffer_object(p);
    float depth = gbuffer_depth(p);
    vec3 n = normal(p);
    vec3 ray = frame_ray(p);
    float facing = max(abs(dot(n, normalize(ray))), 0.02);
    float footprint = depth * max(abs(frame.ray.x) * 2.0 / float(frame.extent.x), abs(frame.ray.y) * 2.0 / float(frame.extent.y));
    float reach = 4.0 * footprint / facing;

    vec3 px, py, nx, ny;
    bool found = differences(p, ivec2(1, 0), object, depth, reach, px, nx);
    found = differences(p, ivec2(0, 1), object, depth, reach, py, ny) && found;
    vec3 t = normalize(abs(n.z) < 0.7 ? cross(n, vec3(0.0, 0.0, 1.0)) : cross(n, vec3(1.0, 0.0, 0.0)));
    vec3 b = cross(n, t);
    mat2 a = mat2(dot(px, t), dot(px, b), dot(py, t), dot(py, b));
    float area = determinant(a);
    // No neighbour on the surface: as curved as a sample can show, which asks for the finest shading.
    vec2 k = vec2(1.0 / footprint);
    if (found && abs(area) > 1e-4 * footprint * footprint) {
        mat2 s = mat2(dot(nx, t), dot(nx, b), dot(ny, t), dot(ny, b)) * inverse(a);
        float mean = 0.5 * (s[0][0] + s[1][1]);
        float off = 0.5 * (s[0][1] + s[1][0]);
        float spread = length(vec2(0.5 * (s[0][0] - s[1][1]), off));
        k = mean >= 0.0 ? vec2(mean + spread, mean - spread) : vec2(mean - spread, mean + spread);
    }
    imageStore(curvature, p, vec4(clamp(k, -LARGEST, LARGEST), 0.0, 0.0));
}
