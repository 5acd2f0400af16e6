#version 460
// Writes a texel's tangent frame in the world: normal; tangent as tangent.glsl encodes it. What faces away from the eye stays
// without.
#include "tangent.glsl"

layout(push_constant) uniform Push {
    vec4 world_from_object[3];
    vec4 normal_from_object[3];
    vec4 eye;
} push;

layout(location = 0) in vec3 world_position;
layout(location = 1) in vec3 world_normal;
layout(location = 2) in vec4 world_tangent;

layout(location = 0) out vec4 surface;

void main() {
    vec3 n = normalize(world_normal);
    // The triangle's own normal, on the side of the interpolated one: winding in the texture says nothing.
    vec3 face = cross(dFdx(world_position), dFdy(world_position));
    face = dot(face, face) > 0.0 ? face * sign(dot(face, n)) : n;
    if (dot(face, world_position - push.eye.xyz) >= 0.0) {
        discard;
    }
    surface = vec4(n, tangent_encode(n, world_tangent.xyz, world_tangent.w));
}
