// The frame in which reflectances are evaluated.
#ifndef LOCAL_GLSL
#define LOCAL_GLSL
#include "tangent.glsl"

// The shading frame: z the normal, bent towards the viewer where it faces away; the viewer in the half plane y = 0, x >= 0.
struct Local {
    vec3 x, y, z;
    vec3 view;
};

const float FACING = 0.02;

Local local_frame(vec3 n, vec3 v) {
    float c = dot(n, v);
    vec3 across = v - n * c; // the view direction's part in the tangent plane
    if (dot(across, across) < 1e-12) {
        across = abs(n.z) < 0.7 ? cross(n, vec3(0.0, 0.0, 1.0)) : cross(n, vec3(1.0, 0.0, 0.0));
    }
    Local f;
    if (c < FACING) {
        vec3 away = normalize(n - v * c);
        n = v * FACING + away * sqrt(1.0 - FACING * FACING);
        c = FACING;
        across = v - n * c;
    }
    f.z = n;
    f.x = normalize(across);
    f.y = cross(n, f.x);
    f.view = vec3(sqrt(max(1.0 - c * c, 0.0)), 0.0, c);
    return f;
}

// What turns local directions into the tangent frame, whose tangent and handedness t holds; without, the local frame stands for it.
vec3 tangent_turn(Local f, vec4 t) {
    vec2 at = vec2(dot(f.x, t.xyz), dot(f.x, cross(f.z, t.xyz)));
    return t.w == 0.0 ? vec3(1.0, 0.0, 1.0) : vec3(normalize(at), t.w);
}

vec3 to_world(Local f, vec3 w) {
    return f.x * w.x + f.y * w.y + f.z * w.z;
}

#endif
