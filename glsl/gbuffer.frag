#version 460
// Writes the G-buffer in the encoding that glsl/bridge/gbuffer.glsl reads.
// variant: plain
// variant: coordinates COORDINATES
#include "tangent.glsl"

layout(push_constant) uniform Push {
    mat4 clip_from_object;
    vec4 normal_from_object[3];
    uvec4 id;
} push;

layout(location = 0) in vec3 world_normal;
#ifdef COORDINATES
layout(location = 1) in vec2 uv;
layout(location = 2) in vec4 world_tangent;
#endif

layout(location = 0) out vec4 surface;
layout(location = 1) out uint ids;
#ifdef COORDINATES
layout(location = 2) out vec4 coordinate;
layout(location = 3) out vec4 derivative;
#endif

void main() {
    // The interpolated reciprocal of w is 1/depth along the view axis for every pinhole projection.
    vec3 n = normalize(world_normal);
    surface = vec4(n, 1.0 / gl_FragCoord.w);
    ids = push.id.x;
#ifdef COORDINATES
    coordinate = vec4(uv, tangent_encode(n, world_tangent.xyz, world_tangent.w), 0.0);
    derivative = vec4(dFdx(uv), dFdy(uv));
#endif
}
