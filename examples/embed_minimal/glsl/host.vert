#version 460
// The host's own geometry pass; its objects are only moved, so object normals are world normals.

layout(push_constant) uniform Push {
    mat4 clip_from_object;
    uvec2 ids; // material, object
} push;

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;

layout(location = 0) out vec3 world_normal;

void main() {
    gl_Position = push.clip_from_object * vec4(position, 1.0);
    world_normal = normal;
}
