#version 460
// Rasterises one object: world normal and clip position.

layout(push_constant) uniform Push {
    mat4 clip_from_object;
    vec4 normal_from_object[3]; // columns; world normals, up to length
    uvec4 id;                   // (object << 16 | material) + 1
} push;

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 coordinate;

layout(location = 0) out vec3 world_normal;
layout(location = 1) out vec2 uv;

void main() {
    gl_Position = push.clip_from_object * vec4(position, 1.0);
    world_normal = push.normal_from_object[0].xyz * normal.x + push.normal_from_object[1].xyz * normal.y
        + push.normal_from_object[2].xyz * normal.z;
    uv = coordinate;
}
