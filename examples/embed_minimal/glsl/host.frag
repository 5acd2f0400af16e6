#version 460
// Writes the G-buffer that bridge/gbuffer.glsl reads.
#include "octahedral.glsl"

layout(push_constant) uniform Push {
    mat4 clip_from_object;
    uvec2 ids; // material, object
} push;

layout(location = 0) in vec3 world_normal;

layout(location = 0) out uint normal;
layout(location = 1) out uvec2 ids;

void main() {
    normal = octahedral_pack(normalize(world_normal));
    ids = push.ids;
}
