// Local lights: points and directions are summed exactly, spheres and rectangles are sampled (src/light.rs).
#ifndef LIGHTS_GLSL
#define LIGHTS_GLSL
#include "angles.glsl"

const float LIGHT_POINT = 0.0;
const float LIGHT_DIRECTIONAL = 1.0;
const float LIGHT_SPHERE = 2.0;

struct LightRecord {
    vec4 place;   // world position, or direction towards the light; kind
    vec4 power;   // intensity in W/sr, irradiance, or radiance; radius
    vec4 edge_u;  // half-edge of a rectangle; the light's number as the host counts
    vec4 edge_v;  // half-edge of a rectangle
};

// Direction towards an exact light in xyz, and the factor on its power in w, at world point p.
vec4 light_exact(LightRecord light, vec3 p) {
    if (light.place.w == LIGHT_DIRECTIONAL) {
        return vec4(light.place.xyz, 1.0);
    }
    vec3 d = light.place.xyz - p;
    float r2 = max(dot(d, d), 1e-12);
    return vec4(d * inversesqrt(r2), 1.0 / r2);
}

// 1 - cos of a sphere's half-angle seen from distance d, or 0 from inside: it radiates outwards.
float sphere_cap(float radius, float d) {
    float s2 = radius * radius / (d * d);
    return s2 < 1.0 ? s2 / (1.0 + sqrt(1.0 - s2)) : 0.0;
}

// Density in 1/sr with which light_sample draws unit direction w at p: 0 where w misses the light or sees its back.
float light_density(LightRecord light, vec3 p, vec3 w) {
    vec3 d = light.place.xyz - p;
    if (light.place.w == LIGHT_SPHERE) {
        float distance = length(d);
        float cap = sphere_cap(light.power.w, distance);
        vec3 off = w * distance - d; // |off|^2 = 2 distance^2 (1 - cos), without cancellation
        return dot(off, off) < 2.0 * distance * distance * cap ? 1.0 / (2.0 * PI * cap) : 0.0;
    }
    vec3 n = cross(light.edge_u.xyz, light.edge_v.xyz);
    float facing = -dot(w, n);
    float t = -dot(d, n) / facing;
    if (facing <= 0.0 || t <= 0.0) {
        return 0.0;
    }
    vec3 q = w * t - d;
    float n2 = dot(n, n);
    vec2 at = vec2(dot(cross(q, light.edge_v.xyz), n), dot(cross(light.edge_u.xyz, q), n));
    // dA cos / t^2 with the area 4 |n|
    return all(lessThanEqual(abs(at), vec2(n2))) ? t * t / (4.0 * facing) : 0.0;
}

// A unit direction towards an area light, uniform in solid angle (sphere) or in area (rectangle).
vec3 light_sample(LightRecord light, vec3 p, vec2 u) {
    vec3 d = light.place.xyz - p;
    if (light.place.w == LIGHT_SPHERE) {
        float distance = length(d);
        vec3 z = d / distance;
        vec3 x = normalize(abs(z.z) < 0.7 ? cross(z, vec3(0.0, 0.0, 1.0)) : cross(z, vec3(1.0, 0.0, 0.0)));
        float c = u.x * sphere_cap(light.power.w, distance); // 1 - cos
        vec2 phi = cos_sin((u.y * 2.0 - 1.0) * PI) * sqrt(c * (2.0 - c));
        return x * phi.x + cross(z, x) * phi.y + z * (1.0 - c);
    }
    return normalize(d + light.edge_u.xyz * (2.0 * u.x - 1.0) + light.edge_v.xyz * (2.0 * u.y - 1.0));
}

#endif
