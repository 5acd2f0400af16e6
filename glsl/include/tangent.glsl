// A tangent frame in one number: the tangent's angle about the normal from a direction that the normal alone gives, and the
// bitangent's side in the sign. src/reflectance/frame.rs is the f64 twin.
#ifndef TANGENT_GLSL
#define TANGENT_GLSL
#include "angles.glsl"

const float TANGENT_OFFSET = 4.0; // beyond pi: 0 is for no tangent

// Two unit vectors that form a right-handed frame with unit n (Duff et al. 2017, "Building an orthonormal basis, revisited").
void tangent_basis(vec3 n, out vec3 x, out vec3 y) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    x = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    y = vec3(b, s + n.y * n.y * a, -n.y);
}

// t need not be perpendicular to n, nor of length one; handedness is that of the bitangent, handedness * cross(n, t).
float tangent_encode(vec3 n, vec3 t, float handedness) {
    vec3 x, y;
    tangent_basis(n, x, y);
    vec2 at = vec2(dot(t, x), dot(t, y));
    if (handedness == 0.0 || dot(at, at) == 0.0) {
        return 0.0;
    }
    return (atan_full(at.y, at.x) + TANGENT_OFFSET) * (handedness < 0.0 ? -1.0 : 1.0);
}

// Unit tangent and handedness; all zero for none.
vec4 tangent_decode(vec3 n, float code) {
    vec3 x, y;
    tangent_basis(n, x, y);
    vec2 turn = cos_sin(clamp(abs(code) - TANGENT_OFFSET, -PI, PI));
    return code == 0.0 ? vec4(0.0) : vec4(x * turn.x + y * turn.y, code < 0.0 ? -1.0 : 1.0);
}

// World from the tangent frame of unit n: about tangent t of such handedness, or about any if there is none.
mat3 tangent_frame(vec3 n, vec4 t) {
    vec3 x, y;
    tangent_basis(n, x, y);
    x = t.w != 0.0 ? t.xyz : x;
    y = t.w != 0.0 ? cross(n, x) * t.w : y;
    return mat3(x, y, n);
}

#endif
