#version 460
// Rasterises one object over its texture coordinates: a pixel is a texel of the map of its lobes.

layout(push_constant) uniform Push {
    vec4 world_from_object[3];  // rows
    vec4 normal_from_object[3]; // columns; world normals, up to length
    vec4 eye;                   // world position
} push;

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 coordinate;
layout(location = 3) in vec4 tangent; // direction of growing u and handedness; all zero for none

layout(location = 0) out vec3 world_position;
layout(location = 1) out vec3 world_normal;
layout(location = 2) out vec4 world_tangent;

void main() {
    // Textures count rows from the top, coordinates upwards.
    gl_Position = vec4(2.0 * coordinate.x - 1.0, 1.0 - 2.0 * coordinate.y, 0.0, 1.0);
    vec4 p = vec4(position, 1.0);
    world_position = vec3(dot(push.world_from_object[0], p), dot(push.world_from_object[1], p), dot(push.world_from_object[2], p));
    // As gbuffer.vert.
    vec3 a = push.normal_from_object[0].xyz, b = push.normal_from_object[1].xyz, c = push.normal_from_object[2].xyz;
    world_normal = a * normal.x + b * normal.y + c * normal.z;
    float side = dot(a, cross(b, c)) < 0.0 ? -1.0 : 1.0;
    world_tangent = vec4(cross(b, c) * tangent.x + cross(c, a) * tangent.y + cross(a, b) * tangent.z, tangent.w) * side;
}
