#version 460
// Rasterises one object: world normal and clip position, texture coordinates and tangents where materials depend on them.
// variant: plain
// variant: coordinates COORDINATES

layout(push_constant) uniform Push {
    mat4 clip_from_object;
    vec4 normal_from_object[3]; // columns; world normals, up to length
    uvec4 id;                   // (object << 16 | material) + 1
} push;

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
#ifdef COORDINATES
layout(location = 2) in vec2 coordinate;
layout(location = 3) in vec4 tangent; // direction of growing u and handedness; all zero for none
#endif

layout(location = 0) out vec3 world_normal;
#ifdef COORDINATES
layout(location = 1) out vec2 uv;
layout(location = 2) out vec4 world_tangent;
#endif

void main() {
    gl_Position = push.clip_from_object * vec4(position, 1.0);
    vec3 a = push.normal_from_object[0].xyz, b = push.normal_from_object[1].xyz, c = push.normal_from_object[2].xyz;
    world_normal = a * normal.x + b * normal.y + c * normal.z;
#ifdef COORDINATES
    uv = coordinate;
    // World from object is the cofactor matrix of the normals' matrix over its determinant; a mirror image changes handedness.
    float side = dot(a, cross(b, c)) < 0.0 ? -1.0 : 1.0;
    world_tangent = vec4(cross(b, c) * tangent.x + cross(c, a) * tangent.y + cross(a, b) * tangent.z, tangent.w) * side;
#endif
}
