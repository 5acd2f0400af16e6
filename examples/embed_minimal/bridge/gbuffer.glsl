// This host's G-buffer behind passband's accessors: the signatures of passband's own glsl/bridge/gbuffer.glsl.
#ifndef BRIDGE_GBUFFER_GLSL
#define BRIDGE_GBUFFER_GLSL
#include "octahedral.glsl"

layout(set = 0, binding = 0) uniform sampler2D host_depth;    // near plane / depth along the view axis; 0 for nothing
layout(set = 0, binding = 1) uniform usampler2D host_normals; // octahedral world normal
layout(set = 0, binding = 2) uniform usampler2D host_ids;     // material, object

const float HOST_NEAR = 0.1; // metres; NEAR in scene.rs

bool gbuffer_covered(ivec2 p) {
    return texelFetch(host_depth, p, 0).x > 0.0;
}

uint gbuffer_material(ivec2 p) {
    return texelFetch(host_ids, p, 0).x;
}

uint gbuffer_object(ivec2 p) {
    return texelFetch(host_ids, p, 0).y;
}

vec3 gbuffer_normal(ivec2 p) {
    return octahedral_unpack(texelFetch(host_normals, p, 0).x);
}

float gbuffer_depth(ivec2 p) {
    return HOST_NEAR / texelFetch(host_depth, p, 0).x;
}

// This host has no textured materials.
vec2 gbuffer_uv(ivec2 p) {
    return vec2(0.0);
}

vec4 gbuffer_tangent(ivec2 p) {
    return vec4(0.0);
}

vec4 gbuffer_footprint(ivec2 p) {
    return vec4(0.0);
}

#endif
