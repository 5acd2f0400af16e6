// The accessors through which every pass reads the G-buffer. A host with its own encoding replaces this file, keeps the
// signatures, compiles the passes that include it (scripts/compile-shaders --bridge) and binds its own set 0.
#ifndef BRIDGE_GBUFFER_GLSL
#define BRIDGE_GBUFFER_GLSL
#include "tangent.glsl"

layout(set = 0, binding = 0) uniform sampler2D gbuffer_surface;    // world normal, depth along the view axis in metres
layout(set = 0, binding = 1) uniform usampler2D gbuffer_ids;       // 0: nothing; else (object << 16 | material) + 1
layout(set = 0, binding = 2) uniform sampler2D gbuffer_coordinate; // texture coordinate; tangent as tangent.glsl encodes it
layout(set = 0, binding = 3) uniform sampler2D gbuffer_derivative; // d(uv)/dx, d(uv)/dy in texture units a sample

bool gbuffer_covered(ivec2 p) {
    return texelFetch(gbuffer_ids, p, 0).x != 0u;
}

// Only where covered:
uint gbuffer_material(ivec2 p) {
    return (texelFetch(gbuffer_ids, p, 0).x - 1u) & 0xffffu;
}

uint gbuffer_object(ivec2 p) {
    return (texelFetch(gbuffer_ids, p, 0).x - 1u) >> 16;
}

vec3 gbuffer_normal(ivec2 p) {
    return texelFetch(gbuffer_surface, p, 0).xyz;
}

float gbuffer_depth(ivec2 p) {
    return texelFetch(gbuffer_surface, p, 0).w;
}

vec2 gbuffer_uv(ivec2 p) {
    return texelFetch(gbuffer_coordinate, p, 0).xy;
}

// Unit tangent (direction of growing u) and handedness: the bitangent is handedness * cross(normal, tangent). Zero for none.
vec4 gbuffer_tangent(ivec2 p) {
    return tangent_decode(gbuffer_normal(p), texelFetch(gbuffer_coordinate, p, 0).z);
}

vec4 gbuffer_footprint(ivec2 p) {
    return texelFetch(gbuffer_derivative, p, 0);
}

#endif
